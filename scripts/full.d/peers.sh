# Tries plcio's OPC UA, MQTT, zenoh and HAL, and MCAP files, with peers of another make: asyncua, mosquitto, pysparkplug, LinuxCNC, eclipse-zenoh, mcap, @mcap/core; and the example of a retrofit with all of its parts; GPIO with a fake chip, and EtherCAT with a simulated segment.
#
# What is missing is installed from Debian and PyPI: LinuxCNC (270 MB) and mosquitto as root, Python's packages
# into a folder of their own.
head=$'unit\tresult\tseconds'

units() { printf 'opcua\nmqtt\nzenoh\nhal\nretrofit\ngpio\nethercat\nmcap\n'; }

unit() {
  local start=$SECONDS
  if [[ $1 = hal || $1 = retrofit ]] && [ ! -x /usr/lib/linuxcnc/realtime ]; then
    { apt-get update -q && apt-get install -y -q --no-install-recommends linuxcnc-uspace; } >&2 || return 1
  fi
  if [ "$1" = mcap ]; then
    cargo test --locked -p plcc --features mcap --test mcap --test real_control --test replay >&2 || return 1
  else
    cargo test --locked -p plcio --features opcua,mqtt,gpio,ethercat,zenoh >&2 || return 1
  fi
  PLCC_PEERS=all tests/peers/run "$1" >&2 || return 1
  printf '%s\tpassed\t%s\n' "$1" $((SECONDS - start))
}
