# How late ticks of 1 ms begin with all drivers busy and with none, side by side.
#
# The example examples/retrofit runs FULL_WIRING_SECONDS (60 unless it is set): in the unit `alone` the control
# with its image file, in `drivers` with plcio, whose Modbus client polls the remote I/O every millisecond and
# whose Modbus server answers a panel without a pause. Use the machine for nothing else, and permit a
# real-time priority (ulimit -r 50). cyclictest (Debian's package rt-tests) runs beside it, at the same priority and
# interval; without it its columns are empty.
head=$'unit\tticks\tlatest tick, µs\t99.9 % by, µs\tmedian, µs\tcyclictest maximum, µs\tcyclictest average, µs'

units() { printf 'alone\ndrivers\n'; }

unit() {
  local work=$state/$1 pid pids=() cyclic theirs seconds=${FULL_WIRING_SECONDS:-60}
  cargo build --release --locked -p plcc -p plcrt -p plcio >&2 || return 1
  PATH=$CARGO_TARGET_DIR/release:$PATH
  rm -rf "$work" && mkdir -p "$work"
  sed -e 's/^period = .*/period = 1/' -e 's/^poll_ms = .*/poll_ms = 1/' \
    -e "s|^image = .*|image = \"/dev/shm/plcc-wiring-$$\"|" \
    examples/retrofit/controller.toml >"$work/controller.toml"
  plcc build examples/retrofit/lathe.pmi -o "$work/lathe.plcx" >&2 || return 1
  if [ "$1" = drivers ]; then
    python3 examples/retrofit/machine.py 15503 >/dev/null & pids+=($!)
    plcio "$work/controller.toml" >/dev/null 2>"$work/plcio.err" & pids+=($!)
    (while :; do python3 examples/retrofit/panel.py 15502 >/dev/null 2>&1; done) >/dev/null & pids+=($!)
  fi
  if command -v cyclictest >/dev/null; then
    cyclictest --mlockall --priority=50 --interval=1000 --duration="$seconds" --quiet >"$state/$1.cyclic" 2>&1 &
    cyclic=$!
  fi
  plcrt --config "$work/controller.toml" --for "${seconds}s" >&2 || return 1
  [ -z "${cyclic:-}" ] || wait "$cyclic" || true
  for pid in ${pids[@]+"${pids[@]}"}; do kill "$pid" 2>/dev/null || true; done
  rm -f "/dev/shm/plcc-wiring-$$"
  theirs=$(sed -n 's/.*Avg: *\([0-9]*\) Max: *\([0-9]*\).*/\2\t\1/p' "$state/$1.cyclic" 2>/dev/null | tail -1)
  python3 - "$1" "$work/plcrt.jsonl" "${theirs:-$'\t'}" <<'PYTHON'
import json, sys
entries = [json.loads(line) for line in open(sys.argv[2])]
timing = next(entry for entry in entries if entry["kind"] == "timing")
late = timing["lateness"]
print(sys.argv[1], late["count"], late["max_us"], late["p999_us"], late["p50_us"], sys.argv[3], sep="\t")
PYTHON
}

# The computer and its kernel, on which all figures depend.
note() { uname -srm; }
