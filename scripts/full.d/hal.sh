# Runs components of the examples in sessions of LinuxCNC's HAL, and compares every tick with `plcc run`.
#
# LinuxCNC takes about 270 MB. It is installed from Debian's packages where it is missing, which takes root.
head=$'unit\tresult'

units() {
  echo all
}

unit() {
  local packages="linuxcnc-uspace linuxcnc-uspace-dev"
  if [ ! -f /usr/include/linuxcnc/hal.h ]; then
    apt-get update -q >&2 && apt-get install -y -q --no-install-recommends $packages >&2 || return 1
  fi
  cargo test --release --locked -p plcc --test hal -- --nocapture >&2 || return 1
  tests_ran "$1" || return 1
  ! grep -q '^skipped' "$state/logs/$1" || return 1
  printf '%s\tthe same in every tick\n' "$1"
}
