# A controller that boots: a clean Debian with the package, in qemu. Units start by themselves and in their order, the operator's screen is on the console, a control that is killed is started again, a watchdog resets the computer, and retained data survive a restart and a power cut.
#
# Needs root, a mirror of Debian, and Debian's packages mmdebstrap, e2fsprogs and qemu-system-x86; without one of these the check is
# skipped. FULL_BOOT_PACKAGE names a package that is there already; without it scripts/deb builds one. It takes a few minutes where the
# processor runs virtual machines (/dev/kvm), longer where qemu interprets it; FULL_BOOT_ACCEL=tcg chooses that. What the computer writes to its serial console is in target/full/boot/all/console.
head=$'unit\tresult\tseconds'

units() { echo all; }

# How long the computer may take for a command or to boot, in seconds.
patience=600

# Starts the computer. Its console, with a shell of root on it, is the file descriptors ${vm[0]} and ${vm[1]}.
power_on() {
  local accel=${FULL_BOOT_ACCEL:-tcg}
  [ -n "${FULL_BOOT_ACCEL:-}" ] || ! { [ -w /dev/kvm ] && grep -qwE 'vmx|svm' /proc/cpuinfo; } || accel=kvm
  coproc vm {
    exec qemu-system-x86_64 -accel "$accel" -cpu max -smp 2 -m 1024 -display none -monitor none -serial stdio \
      -device i6300esb -action watchdog=reset -nic none \
      -kernel "$work/vmlinuz" -initrd "$work/initrd" -append 'root=/dev/vda rw console=ttyS0 loglevel=4 panic=1' \
      -drive "file=$work/disk,format=raw,if=virtio,cache=writeback" 2>>"$work/qemu"
  }
  computer=$vm_PID
  exec {out}<&"${vm[0]}" {in}>&"${vm[1]}"
}

# As when somebody pulls the plug.
power_cut() {
  kill -KILL "$computer" && wait "$computer" 2>/dev/null
  exec {out}<&- {in}>&-
}

# Reads the console up to a line that begins with a mark, gives what came before as `answer` and what stands after the mark as
# `status`.
read_to() {
  local mark=$1 line
  answer=
  while IFS= read -r -t "$patience" -u "$out" line; do
    line=${line//$'\r'/}
    printf '%s\n' "$line" >>"$work/console"
    case $line in
      *"$mark"*) status=${line##*"$mark"}; return 0 ;;
    esac
    answer+=$line$'\n'
  done
  echo "the computer does not answer; its console is $work/console" >&2
  return 1
}

# Waits until the computer has booted and a shell answers.
booted() {
  read_to 'boot-check ready' || return 1
  guest 'systemctl is-system-running --wait' || { printf 'the system is %s' "$answer" >&2; return 1; }
}

# Runs a command there, gives its output as `answer` and its exit status.
guest() {
  printf '%s\necho ":end:$?"\n' "$1" >&"$in"
  read_to ':end:' && return "$status"
}

# Runs a command there again and again until it succeeds.
soon() {
  local deadline=$((SECONDS + 60))
  until guest "$1"; do
    [ $SECONDS -lt $deadline ] || { printf 'never: %s\n%s' "$1" "$answer" >&2; return 1; }
    sleep 0.5
  done
}

# Whether a command there succeeds and prints a line.
prints() {
  guest "$1" && grep -qx -- "$2" <<<"$answer" || {
    printf '%s printed, with exit status %s and without %s:\n%s' "$1" "$status" "$2" "$answer" >&2
    return 1
  }
}

# The clean computer: the package, a machine's program, and what docs/deploying.md says.
install_computer() {
  local root=$work/root package=${FULL_BOOT_PACKAGE:-}
  if [ -z "$package" ]; then
    scripts/deb >&2 || return 1
    package=$(ls "$CARGO_TARGET_DIR"/debian/plcc_*.deb)
  fi
  [ -f "$state/booting.tar" ] || {
    mmdebstrap --format=tar --variant=minbase --include=systemd-sysv,udev,dbus,kmod,linux-image-amd64 bookworm "$state/booting.part" >&2 &&
      mv "$state/booting.part" "$state/booting.tar"
  } || return 1
  mkdir "$root"
  tar -xf "$state/booting.tar" -C "$root" --exclude='./dev/*' || return 1
  : >"$root/dev/null"
  cp "$package" "$root/plcc.deb"
  cp "$root"/boot/vmlinuz-* "$work/vmlinuz" && cp "$root"/boot/initrd.img-* "$work/initrd" || return 1
  echo machine >"$root/etc/hostname"
  # A shell of root on the serial line, for this script.
  mkdir -p "$root/etc/systemd/system/serial-getty@ttyS0.service.d"
  cat >"$root/etc/systemd/system/serial-getty@ttyS0.service.d/login.conf" <<'UNIT'
[Service]
ExecStart=
ExecStart=-/sbin/agetty --autologin root --keep-baud 115200 %I dumb
UNIT
  cat >"$root/root/.bash_profile" <<'SHELL'
set +o emacs
stty -echo
PS1= PS2=
dmesg -n 1
echo boot-check ready
SHELL
  chroot "$root" dpkg -i /plcc.deb >&2 || return 1
  cat >"$root/etc/plcrt/lathe.pmi" <<'PMI'
$OUTPUT
LAMP = 1/0
$INTEGER
STARTS
$MESSAGE
ON = "LAMP ON"
$END
IF (@IPL)
 @NVINT[0] = @NVINT[0] + 1
ENDIF
STARTS = @NVINT[0]
LAMP = T
ON = LAMP
@CL103 = @CP103
PMI
  # The period is long, since qemu may be slow.
  cat >"$root/etc/plcrt/lathe.toml" <<'TOML'
artifact = "lathe.plcx"
period = "500ms"
retain = "/var/lib/plcrt/lathe/retained"
log = "/var/log/plcrt/lathe/log.jsonl"
image = "/run/plcrt/lathe/image"
socket = "/run/plcrt/lathe/socket"
allow = ["operate"]
restart = 2
[plcio]
modbus-server = "127.0.0.1:502"
[[io]]
name = "LAMP"
driver = "modbus-server"
address = "discrete/0"
TOML
  chroot "$root" sh -eu -c '
    cd /etc/plcrt
    plcc build lathe.pmi -o lathe.plcx
    plcrt check-config lathe.toml
    systemctl enable plcrt@lathe plcio@lathe plcrt-operator@lathe' >&2 || return 1
  truncate -s 3G "$work/disk"
  mke2fs -q -t ext4 -d "$root" "$work/disk" >&2 && rm -rf "$root"
}

# How often the control has started since the machine was set up, as the program counts it in retained data.
starts='timeout 30 plcctl /run/plcrt/lathe/socket get STARTS'
# The control, a child of the supervisor.
control='$(cat /proc/$(systemctl show -P MainPID plcrt@lathe)/task/*/children)'
# The lamp, read from outside by Modbus: function 2, point 0.
lamp='exec 3<>/dev/tcp/127.0.0.1/502 && printf "\0\1\0\0\0\6\1\2\0\0\0\1" >&3 && timeout 30 head -c 10 <&3 | od -An -tx1'
lit=' 00 01 00 00 00 04 01 02 01 01'

# The order in which the units have started: the control had done its first tick before the drivers were started.
in_order() {
  guest 'systemctl show -P ActiveEnterTimestampMonotonic plcrt@lathe; systemctl show -P ExecMainStartTimestampMonotonic plcio@lathe' || return 1
  local ready drivers
  { read -r ready; read -r drivers; } < <(grep -x '[0-9]*' <<<"$answer")
  [ "$ready" -gt 0 ] && [ "$ready" -le "$drivers" ] || { echo "not in order: $answer" >&2; return 1; }
}

# The operator's screen, as the first console shows it.
on_console() { soon "tr -c '[:print:]' ' ' </dev/vcs1 | grep -F -- '$1'"; }
# As when somebody presses Enter at the console's keyboard.
enter="perl -e 'open T, q(+<), q(/dev/tty1) or die; \$c = chr 13; ioctl T, 0x5412, \$c or die'"

# After each start of the computer: the units run, and what they do is seen from outside.
runs() {
  booted &&
    soon 'systemctl is-active plcrt@lathe plcio@lathe plcrt-operator@lathe' && in_order &&
    prints "$starts" "STARTS=$1" && soon "$lamp" && prints "$lamp" "$lit" && on_console 'L A M P   O N'
}

check() {
  power_on && runs 1 || return 1
  echo "the operator presses a key" >&2
  on_console '. @CP103' && guest "$enter" && on_console '* [@CP103]' || return 1
  prints 'timeout 30 plcctl /run/plcrt/lathe/socket get @CL103' '@CL103=1' || return 1
  echo "a control that is killed is started again by its supervisor" >&2
  guest "sleep 2; kill -KILL $control" && soon "$starts | grep -x STARTS=2" && prints "$lamp" "$lit" || return 1
  prints 'systemctl show -P NRestarts plcrt@lathe' 0 || return 1
  echo "drivers that are killed are started again by systemd" >&2
  guest 'systemctl kill --signal=KILL plcio@lathe' && soon '[ "$(systemctl show -P NRestarts plcio@lathe)" = 1 ]' &&
    soon "$lamp" && prints "$lamp" "$lit" || return 1
  echo "the computer is restarted" >&2
  guest 'sleep 2'
  printf 'systemctl reboot\n' >&"$in"
  runs 3 || return 1
  echo "the power fails" >&2
  guest 'sleep 3'
  power_cut
  power_on && runs 4 || return 1
  echo "a hardware watchdog, as docs/deploying.md has it" >&2
  guest "mkdir -p /etc/systemd/system/plcrt@lathe.service.d
cat >/etc/systemd/system/plcrt@lathe.service.d/watchdog.conf <<END
[Unit]
Requires=dev-watchdog.device
After=dev-watchdog.device
[Service]
PrivateDevices=no
DeviceAllow=/dev/watchdog rw
ExecStart=
ExecStart=/usr/bin/plcrt run --config /etc/plcrt/%i.toml --watchdog-device /dev/watchdog
END
echo 'SUBSYSTEM==\"misc\", KERNEL==\"watchdog\", GROUP=\"plcrt\", MODE=\"0660\", TAG+=\"systemd\"' >/etc/udev/rules.d/60-plcrt.rules
udevadm control --reload && udevadm trigger --settle /dev/watchdog
systemctl daemon-reload && systemctl restart plcrt@lathe" && prints "$starts" STARTS=5 || return 1
  # Its supervisor dies, so that nobody resets the watchdog.
  printf 'sleep 2; kill -KILL $(systemctl show -P MainPID plcrt@lathe)\n' >&"$in"
  runs 6 || return 1
  printf 'systemctl poweroff\n' >&"$in"
  wait "$computer" 2>/dev/null || true
}

unit() {
  local work=$state/$1 start=$SECONDS tool out in computer answer status
  for tool in mmdebstrap:mmdebstrap qemu-system-x86_64:qemu-system-x86 mke2fs:e2fsprogs; do
    command -v "${tool%:*}" >/dev/null || {
      printf '%s\tskipped: %s is missing (package %s)\t0\n' "$1" "${tool%:*}" "${tool#*:}"
      return 0
    }
  done
  [ "$(id -u)" = 0 ] || { printf '%s\tskipped: it needs root\t0\n' "$1"; return 0; }
  rm -rf "$work" && mkdir -p "$work"
  install_computer || return 1
  check || {
    patience=60
    guest "systemctl --no-pager --full status 'plc*'; journalctl --no-pager -b -n 60" && printf '%s' "$answer" >&2
    kill -KILL "$computer" 2>/dev/null
    return 1
  }
  rm -f "$work/disk"
  printf '%s\tunits started in order at four boots; screen for the operator, killed control, killed drivers, restart, power cut, watchdog\t%s\n' "$1" $((SECONDS - start))
}
