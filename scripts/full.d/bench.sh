# Runs each benchmark of benches/ and collects their tables. Use the machine for nothing else.
#
# A unit is a file of benches/benches/.
head=$'benchmark\tresult\tseconds'

units() { for file in "$root"/benches/benches/*.rs; do basename "$file" .rs; done; }

unit() {
  local start=$SECONDS result=measured
  cargo bench --locked -p plcc-benches --bench "$1" >"$state/$1.txt" || result="**fails, see logs/$1**"
  printf '%s\t%s\t%s\n' "$1" "$result" $((SECONDS - start))
}

# The processors, then what each benchmark printed.
note() {
  sed -n 's/^model name[^:]*: //p' /proc/cpuinfo 2>/dev/null | sort | uniq -c | sed 's/^ *\([0-9]*\) /\1 × /'
  local unit
  for unit in $(units); do
    [ -f "$state/rows/$unit" ] || continue
    # Lines of cargo and of the test harness are left out.
    printf '\n### %s\n\n```\n%s\n```\n' "$unit" "$(grep -vE '^(running|test result|$)' "$state/$unit.txt")"
  done
}
