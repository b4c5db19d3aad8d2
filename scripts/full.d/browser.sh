# The monitor's page in Chromium: power flow, overrides, scope, lost connections.
#
# Needs npm; Chromium is installed by apt where it is missing. A unit is one run of tests/browser.
head=$'unit\tresult\tseconds'

units() { seq 1 3; }

unit() {
  local start=$SECONDS result
  (cd "$tree" && cargo build --locked -p plcc -p plcrt && PLCC=$CARGO_TARGET_DIR/debug/plcc tests/browser/run) \
    2>&1 | tee "$state/$1.txt" >&2
  result=$(grep -E '^# (pass|fail) ' "$state/$1.txt" | tr -d '#' | tr '\n' ' ')
  printf '%s\t%s\t%s\n' "$1" "${result:-nothing ran}" $((SECONDS - start))
}
