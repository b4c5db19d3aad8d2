# A controller and its spare, each a clean Debian in a folder of its own: the package is installed in both, the first one runs a
# control as the unit does, its backup is restored in the second one, which is started, and goes on with the same state.
#
# Needs root, mmdebstrap (Debian's package of that name) and a mirror of Debian. FULL_SPARE_PACKAGE names a package that is
# there already; without it scripts/deb builds one. systemd itself does not run in a folder: the script does what the unit says
# (user, folders, the command of ExecStart).
head=$'unit\tresult'

units() { echo all; }

# Runs a command in a folder's Debian, with its /proc.
inside() {
  local root=$1
  shift
  unshare --mount --pid --fork --mount-proc="$root/proc" chroot "$root" "$@"
}

# What systemd does for plcrt@lathe: the folders, the user, and the command of the unit, for the time that is given.
serve() {
  local root=$1 seconds=$2
  inside "$root" sh -eu -c '
    command=$(sed -n "s/^ExecStart=//p" /usr/lib/systemd/system/plcrt@.service | sed "s/%i/lathe/g")
    drivers=$(sed -n "s/^ExecStart=//p" /usr/lib/systemd/system/plcio@.service | sed "s/%i/lathe/g")
    install -d -o plcrt -g plcrt /run/plcrt /run/plcrt/lathe /var/lib/plcrt /var/lib/plcrt/lathe /var/log/plcrt /var/log/plcrt/lathe
    umask 077
    as="setpriv --reuid plcrt --regid plcrt --clear-groups --no-new-privs"
    $as $command & control=$!
    $as $drivers & driver=$!
    sleep '"$seconds"'
    $as plcctl /run/plcrt/lathe/socket get "@NVINT[0]" STARTS LAMP
    kill -TERM $driver; wait $driver || [ $? = 130 ]
    kill -TERM $control; wait $control || [ $? = 130 ]'
}

unit() {
  local work=$state/$1 package=${FULL_SPARE_PACKAGE:-} root
  command -v mmdebstrap >/dev/null || { echo "mmdebstrap is missing" >&2; return 1; }
  if [ -z "$package" ]; then
    scripts/deb >&2 || return 1
    package=$(ls "$CARGO_TARGET_DIR"/debian/plcc_*.deb)
  fi
  rm -rf "$work" && mkdir -p "$work"
  [ -f "$state/clean.tar" ] || mmdebstrap --variant=minbase bookworm "$state/clean.tar" >&2 || return 1
  for root in machine spare; do
    mkdir "$work/$root"
    tar -xf "$state/clean.tar" -C "$work/$root" --exclude='./dev/*' || return 1
    : >"$work/$root/dev/null"
    cp "$package" "$work/$root/plcc.deb"
    inside "$work/$root" dpkg -i /plcc.deb >&2 || return 1
  done
  cat >"$work/machine/etc/plcrt/lathe.pmi" <<'PMI'
$INPUT
DOOR = 0/0
$OUTPUT
LAMP = 1/0
$INTEGER
STARTS
$END
IF (@IPL)
 @NVINT[0] = @NVINT[0] + 1
ENDIF
STARTS = @NVINT[0]
LAMP = T
PMI
  cat >"$work/machine/etc/plcrt/lathe.toml" <<'TOML'
artifact = "lathe.plcx"
retain = "/var/lib/plcrt/lathe/retained"
log = "/var/log/plcrt/lathe/log.jsonl"
image = "/run/plcrt/lathe/image"
socket = "/run/plcrt/lathe/socket"
[plcio]
modbus-server = "127.0.0.1:15599"
[[io]]
name = "DOOR"
driver = "modbus-server"
address = "coil/0"
[[io]]
name = "LAMP"
driver = "modbus-server"
address = "discrete/0"
TOML
  inside "$work/machine" sh -c 'cd /etc/plcrt && plcc build lathe.pmi -o lathe.plcx && plcrt check-config lathe.toml' >&2 || return 1
  serve "$work/machine" 3 >"$work/first" || return 1
  serve "$work/machine" 3 >"$work/second" || return 1
  # The backup: three folders, with the package beside them.
  tar -C "$work/machine" -czf "$work/backup.tar.gz" etc/plcrt var/lib/plcrt || return 1
  inside "$work/spare" tar -C / -xzf - <"$work/backup.tar.gz" || return 1
  serve "$work/spare" 3 >"$work/third" || return 1
  grep -qx 'STARTS=1' "$work/first" && grep -qx 'STARTS=2' "$work/second" && grep -qx 'STARTS=3' "$work/third" || {
    cat "$work/first" "$work/second" "$work/third" >&2
    return 1
  }
  printf '%s\tthe spare goes on where the machine was\n' "$1"
}
