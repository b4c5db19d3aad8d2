# Breaks the compiler on purpose in one place at a time; for each place some test must fail.
#
# A mutant is a patch in tests/mutants with a header that says what it breaks
# (tests/mutants/README.md). It is applied to the work tree. First the test runs that the header
# expects to notice it, then the tests below in their order, until one fails. A unit is one mutant.
head=$'mutant\tresult\tkilled by\tseconds\tbreaks'

# A test that takes longer than this many seconds is one that the mutant keeps from ending; it is
# stopped and counts as failed.
most=${FULL_TEST_SECONDS:-1200}

# The tests that are tried for every mutant, in an order in which most mutants are noticed soon.
# The unit tests of the crates that the patch touches run before them.
quick_tests() {
  cat <<'LIST'
-p plcc-ir-tests
-p plcc-codegen --test ops --test dispatch
-p plcc-tests --test all_languages conformance
-p plcc-tests --test pmi
-p plcc-tests --test nct
-p plcc-tests --test pmac
-p plcc-frontend -p plcc-runtime -p plcc-load -p plcc-record -p plcc-host --lib
-p plcc-abi -p plcc-ir -p plcc-codegen -p plcc-frontend --tests
-p plcc-tests --test all_languages --test allocations
-p plcrt -p plcc
LIST
}

patches() { find "$root/tests/mutants" -name '*.patch' 2>/dev/null | sort; }
field() { sed -n "s/^# $2: //p" "$1" | head -1; }

# A unit's name is the patch's and a checksum of it, so that a changed patch is tried again. The
# first unit, `unchanged`, sees that the tests pass without any mutant.
units() {
  echo unchanged
  patches | while read -r patch; do
    echo "$(basename "$patch" .patch)-$(cksum <"$patch" | cut -c1-6 | tr -d ' ')"
  done
}

# The test that a patch's header names, as words for cargo test.
expected_test() { field "$1" 'noticed by' | sed -n 's/^cargo test //p'; }

# The unit tests of the crates that a patch touches, as words for cargo test.
own_tests() {
  sed -n 's#^+++ b/\([a-z]*\)/.*#\1#p' "$1" | sort -u | while read -r folder; do
    package=$(sed -n 's/^name = "\(.*\)"/\1/p' "$tree/$folder/Cargo.toml" 2>/dev/null | head -1)
    [ -z "$package" ] || [ "$folder" = tests ] || echo "-p $package --lib"
  done
}

# Reads words for cargo test, a line for each run, and runs them until one fails. Writes the result
# and the failing test with a tab between.
judge() {
  local words log=$state/test.log
  while read -r words; do
    echo "== cargo test $words" >&2
    # shellcheck disable=SC2086
    if ! cargo test --quiet --locked --no-run $words >&2; then
      printf 'does not build\t'
      return
    fi
    # shellcheck disable=SC2086
    if ! timeout --kill-after=10 "$most" cargo test --locked $words >"$log" 2>&1; then
      tail -60 "$log" >&2
      local test
      test=$(sed -n 's/^test \(.*\) \.\.\. FAILED$/\1/p' "$log" | head -1)
      [ -n "$test" ] || test=$(grep -m1 -oE 'signal: [0-9]+[^)]*\)?' "$log" || echo "no end, or no result")
      printf 'killed\t%s: %s' "$words" "$test"
      return
    fi
  done
  printf 'survived\t'
}

unit() {
  local start=$SECONDS patch result by expected
  git checkout --quiet --force --detach "$commit"
  git clean --quiet --force -d
  if [ "$1" = unchanged ]; then
    IFS=$'\t' read -r result by < <(quick_tests | judge; echo)
    [ "$result" = survived ] || { echo "without a mutant: $result, $by" >&2; return 1; }
    printf 'none\tall tests pass\t\t%s\t\n' $((SECONDS - start))
    return
  fi
  patch=$root/tests/mutants/${1%-*}.patch
  expected=$(field "$patch" expected)
  if git apply "$patch" >&2; then
    IFS=$'\t' read -r result by < <({ expected_test "$patch"; own_tests "$patch"; quick_tests; } | judge; echo)
  else
    result="does not apply" by=
  fi
  case $result-$expected in
    survived-equivalent*) result=equivalent ;;
    survived-*) result='**survived**' ;;
    killed-equivalent*) result='killed, though said to be equivalent' ;;
    killed-*) ;;
    *) result="**$result**" ;;
  esac
  printf '%s\t%s\t%s\t%s\t%s\n' "${1%-*}" "$result" "$by" $((SECONDS - start)) "$(field "$patch" breaks)"
  git checkout --quiet --force --detach "$commit"
}

# How many mutants had each result.
note() {
  find "$state/rows" -type f ! -name '.*' ! -name unchanged -exec cut -f2 {} + \
    | tr -d '*' | sort | uniq -c | sed 's/^ *\([0-9]*\) /\1 /'
}
