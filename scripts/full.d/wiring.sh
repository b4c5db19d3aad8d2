# How late ticks of 1 ms begin with all drivers busy, with Modbus busy, and with none, side by side.
#
# The example examples/retrofit runs FULL_WIRING_SECONDS (60 unless it is set): in the unit `alone` the control
# with its image file; in `modbus` with plcio, whose Modbus client polls the remote I/O every millisecond and
# whose Modbus server answers a panel without a pause; in `all` with OPC UA and MQTT besides: clients read all variables and
# write one without a pause, and a host sends commands and asks for birth certificates without one (tests/peers/busy.py).
# That unit needs mosquitto, and Python with asyncua and pysparkplug, which it installs into a folder of its own.
#
# Use the machine for nothing else, and permit a real-time priority (ulimit -r 50). cyclictest (Debian's package rt-tests)
# runs beside it, at the same priority and interval; without it its columns are empty.
head=$'unit\tticks\tlatest tick, µs\t99.9 % by, µs\tmedian, µs\tcyclictest maximum, µs\tcyclictest average, µs\trequests'

units() { printf 'alone\nmodbus\nall\n'; }

# The configuration of the example with Modbus alone, a tick and a poll of 1 ms; of `all` with OPC UA and MQTT.
configuration() {
  examples/retrofit/start --without-opcua --without-hal --configuration \
    | sed -e 's/^period = .*/period = 1/' -e 's/^poll_ms = .*/poll_ms = 1/' \
      -e "s|^image = .*|image = \"/dev/shm/plcc-wiring-$$\"|"
}
all_drivers() {
  sed -e '/^\[plcio\]/a opcua-server = "127.0.0.1:14840"\nopcua-users = "users"\nmqtt-broker = "mqtt://127.0.0.1:11883"\nmqtt-group = "hall"\nmqtt-node = "lathe"'
  for name in LEFT RIGHT SPINON SPINOK; do printf '[[io]]\nname = "%s"\ndriver = "mqtt"\n' "$name"; done
  printf '[[io]]\nname = "STOPS"\ndriver = "opcua"\ndirection = "in"\ntimeout_ms = 0\n'
  printf '[[io]]\nname = "ATEND"\ndriver = "mqtt"\ndirection = "in"\ntimeout_ms = 0\n'
}

unit() {
  local work=$state/$1 pid pids=() cyclic theirs seconds=${FULL_WIRING_SECONDS:-60} python=$state/python/bin/python
  cargo build --release --locked -p plcc -p plcrt >&2 || return 1
  cargo build --release --locked -p plcio --features opcua,mqtt >&2 || return 1
  PATH=$CARGO_TARGET_DIR/release:$PATH
  rm -rf "$work" && mkdir -p "$work"
  configuration >"$work/controller.toml"
  plcc build examples/retrofit/lathe.pmi -o "$work/lathe.plcx" >&2 || return 1
  if [ "$1" != alone ]; then
    python3 examples/retrofit/machine.py 15503 >/dev/null & pids+=($!)
    (while :; do python3 examples/retrofit/panel.py modbus 15502 >/dev/null 2>&1; done) >/dev/null & pids+=($!)
  fi
  if [ "$1" = all ]; then
    [ -x /usr/sbin/mosquitto ] || { echo "mosquitto is missing" >&2; return 1; }
    { [ -x "$python" ] || python3 -m venv "$state/python"; } >&2 || return 1
    "$python" -m pip install -q 'asyncua>=2.1,<3' 'pysparkplug>=0.6,<1' >&2 || return 1
    all_drivers <"$work/controller.toml" >"$work/all.toml" && mv "$work/all.toml" "$work/controller.toml"
    "$python" examples/retrofit/panel.py certificate "$work" || return 1
    printf 'listener 11883 127.0.0.1\nallow_anonymous true\n' >"$work/mosquitto.conf"
    /usr/sbin/mosquitto -c "$work/mosquitto.conf" >/dev/null 2>&1 & pids+=($!)
    "$python" tests/peers/busy.py opcua 14840 "$work" >"$work/opcua.count" 2>"$work/opcua.err" & pids+=($!)
    "$python" tests/peers/busy.py mqtt 11883 hall/lathe ATEND >"$work/mqtt.count" 2>"$work/mqtt.err" & pids+=($!)
  fi
  if [ "$1" != alone ]; then
    plcio "$work/controller.toml" >/dev/null 2>"$work/plcio.err" & pids+=($!)
  fi
  if command -v cyclictest >/dev/null; then
    cyclictest --mlockall --priority=50 --interval=1000 --duration="$seconds" --quiet >"$state/$1.cyclic" 2>&1 &
    cyclic=$!
  fi
  plcrt run --config "$work/controller.toml" --for "${seconds}s" >&2 || return 1
  [ -z "${cyclic:-}" ] || wait "$cyclic" || true
  for pid in ${pids[@]+"${pids[@]}"}; do kill "$pid" 2>/dev/null || true; done
  for pid in ${pids[@]+"${pids[@]}"}; do wait "$pid" 2>/dev/null || true; done
  rm -f "/dev/shm/plcc-wiring-$$"
  theirs=$(sed -n 's/.*Avg: *\([0-9]*\) Max: *\([0-9]*\).*/\2\t\1/p' "$state/$1.cyclic" 2>/dev/null | tail -1)
  # How many requests OPC UA and MQTT have served: proof that they were busy.
  local requests=""
  if [ "$1" = all ]; then
    requests=$(cat "$work/opcua.count" "$work/mqtt.count" | paste -sd' ')
    [[ $requests == *OPC*MQTT* ]] || { cat "$work"/*.err >&2; return 1; }
  fi
  python3 - "$1" "$work/plcrt.jsonl" "${theirs:-$'\t'}" "$requests" <<'PYTHON'
import json, sys
entries = [json.loads(line) for line in open(sys.argv[2])]
timing = next(entry for entry in entries if entry["kind"] == "timing")
late = timing["lateness"]
print(sys.argv[1], late["count"], late["max_us"], late["p999_us"], late["p50_us"], sys.argv[3], sys.argv[4], sep="\t")
PYTHON
}

# The computer and its kernel, on which all figures depend.
note() { uname -srm; }
