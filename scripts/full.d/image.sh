# 10^7 ticks of an image file under readers and writers in other processes, which are killed at random moments: no torn tick, no torn set of inputs.
#
# A unit is a million ticks.
head=$'unit\tresult\twhat was seen\tseconds'

units() { seq 1 10; }

unit() {
  local start=$SECONDS result=passed
  PLCC_IMAGE_TICKS=1000000 \
    cargo test --release --locked -p plcc-host --test image_processes \
    2>&1 | tee "$state/$1.txt" >&2 || result="**fails, see logs/$1**"
  grep -q ' ticks, .* processes killed$' "$state/$1.txt" || { echo "no test has run" >&2; return 1; }
  printf '%s\t%s\t%s\t%s\n' "$1" "$result" "$(grep ' processes killed$' "$state/$1.txt")" $((SECONDS - start))
}
