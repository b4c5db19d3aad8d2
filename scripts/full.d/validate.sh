# Proves that optimised code does what the code before did: examples, corpus, thousands of random programs; mutants of passes.
#
# The units `examples` and `corpus` build each program there with `plcc build --validate`, FULL_SECONDS for each function (10). A unit of
# random programs is FULL_SEEDS of each language (1000). A unit `mutant-NAME` applies tests/mutants/NAME.patch to the passes, has them
# optimise the modules of tests/ir/filetests and of the programs in tests/conformance, and says whether the unchanged proof refutes what
# they made: in their order, in their order as if the module were long, and what the passes alone make that a file of tests/ir/filetests
# names. It looks only at what is something else than the unchanged passes make; where there is nothing, no module shows the mutant.
# `stops` says that the verifier of the IR finds what a pass made to be wrong. Where all functions of a module are proved, they are run in the
# interpreter too, with random images.
# Nothing may be refuted but mutants.
head=$'programs\tproved\tundecided\trefuted\tseconds'

seconds=${FULL_SECONDS:-10}

units() {
  printf '%s\n' examples corpus random unchanged
  find "$root/tests/mutants" -name 'pass-*.patch' -o -name 'passes-*.patch' | sort | while read -r patch; do
    echo "mutant-$(basename "$patch" .patch)"
  done
}

# Builds each program of a folder, and adds up the answers.
folder() {
  local file text code proved=0 undecided=0 refuted=0
  cargo build --release --locked -p plcc >&2
  while read -r file; do
    code=0
    text=$("$CARGO_TARGET_DIR/release/plcc" build "$file" --validate --timeout "${seconds}s" \
      --message-format json -o "$state/artifact.plcx" 2>>"$state/plcc.log") || code=$?
    # A program with errors (1) has no code. One whose proof ends otherwise counts as refuted, since it must not.
    case $code in
      0 | 4) ;;
      1) continue ;;
      *)
        printf '%s: plcc ended with %s\n' "$file" "$code" >&2
        refuted=$((refuted + 1))
        continue
        ;;
    esac
    proved=$((proved + $(grep -c '"result":"proved"' <<<"$text" || true)))
    undecided=$((undecided + $(grep -c '"result":"undecided"' <<<"$text" || true)))
    if [ "$code" = 4 ]; then
      refuted=$((refuted + 1))
      printf '%s\n%s\n' "$file" "$text" >&2
    fi
  done < <(find "$1" -name '*.pmi' -o -name '*.nct' -o -name '*.pmc' -o -name '*.plc' | sort)
  printf '%s\t%s\t%s' "$proved" "$undecided" "$refuted"
}

# The programs of tests/conformance as modules before any pass; kept.
modules() {
  local file
  [ -d "$state/modules" ] && return
  rm -rf "$state/modules.new"
  mkdir "$state/modules.new"
  cargo build --release --locked -p plcc >&2
  find tests/conformance -name '*.pmi' -o -name '*.nct' -o -name '*.pmc' -o -name '*.plc' | sort | while read -r file; do
    # A program with errors has no module.
    "$CARGO_TARGET_DIR/release/plcc" dev build "$file" --emit ir --opt none -o "$state/modules.new/${file//\//-}.ir" 2>>"$state/plcc.log" || true
  done
  mv "$state/modules.new" "$state/modules"
}

# Optimises modules with the passes of the work tree, in the folder that is named.
optimise() {
  modules
  rm -rf "$1"
  mkdir "$1"
  cp tests/ir/filetests/*.ir tests/ir/filetests/*/*.ir "$1"
  find "$state/modules" -name '*.ir' -exec cp -t "$1" {} +
  # Not optimised it is built in a third of the time, and runs for a second. Users' builds have no checks of overflows either.
  cargo build --locked -p plcc-ir --features text --example optimize --config 'profile.dev.package.plcc-ir.opt-level=0' \
    --config 'profile.dev.package.plcc-ir.overflow-checks=false' >&2 || return
  find "$1" -name '*.ir' | sort | xargs -n 1 timeout 60 "$CARGO_TARGET_DIR/debug/examples/optimize" >&2
}

# Looks at what passes made in a folder: how many functions are proved, undecided and refuted.
look() {
  PLCC_VALIDATE_PAIRS=$1 PLCC_VALIDATE_SECONDS=$seconds "$state/proof" --exact pairs_of_versions --nocapture \
    | tee /dev/stderr | sed -n 's/^\([0-9]*\) proved, \([0-9]*\) undecided, \([0-9]*\) refuted$/\1\t\2\t\3/p'
}

# What the unchanged passes make; kept for the mutants.
unchanged() {
  [ -d "$state/unchanged" ] && return
  optimise "$state/unchanged.new"
  mv "$state/unchanged.new" "$state/unchanged"
}

# Applies a mutant to the passes, and looks at those modules of which they make something else.
mutant() {
  local file stops=0
  git apply "$root/tests/mutants/$1.patch" >&2
  rm -f "$CARGO_TARGET_DIR/debug/examples/optimize"
  optimise "$state/pairs" || stops=1
  git checkout --quiet --force --detach "$commit"
  if [ ! -x "$CARGO_TARGET_DIR/debug/examples/optimize" ]; then
    printf '0\t0\tdoes not build'
    return
  fi
  for file in "$state"/pairs/*.after; do
    ! cmp -s "$file" "$state/unchanged/$(basename "$file")" || rm "$file"
  done
  # The verifier stops a pass in a development build.
  if [ -n "$(find "$state/pairs" -name '*.after')" ]; then
    look "$state/pairs" | if [ $stops = 1 ]; then sed 's/\t0$/\tstops/'; else cat; fi
  elif [ $stops = 1 ]; then
    printf '0\t0\tstops'
  elif grep -q '^# expected: equivalent' "$root/tests/mutants/$1.patch"; then
    printf '0\t0\tmakes the same, as its patch says'
  else
    printf '0\t0\tmakes the same'
  fi
}

# The unchanged proof, as a program that is kept.
proof() {
  [ -x "$state/proof" ] && return
  local built
  built=$(cargo test --release --locked -p plcc-prove --test validate --no-run --message-format json \
    | sed -n 's/.*"executable":"\([^"]*validate[^"]*\)".*/\1/p' | tail -1)
  cp "$built" "$state/proof"
}

unit() {
  local start=$SECONDS result
  git checkout --quiet --force --detach "$commit"
  case $1 in
    examples) result=$(folder examples) ;;
    corpus) result=$(folder tests/corpus) ;;
    random)
      PLCC_SEEDS=${FULL_SEEDS:-1000} cargo test --release --locked -p plcc-prove --test validate \
        passes_do_not -- --nocapture >&2
      tests_ran "$1" || return 1
      result=$(awk -F '[, ]+' '/ functions proved, / { proved += $2; open += $5 } END { printf "%d\t%d\t0", proved, open }' \
        "$state/logs/$1")
      ;;
    unchanged)
      proof
      unchanged
      result=$(look "$state/unchanged")
      ;;
    mutant-*)
      proof
      unchanged
      result=$(mutant "${1#mutant-}")
      ;;
  esac
  printf '%s\t%s\t%s\n' "$1" "$result" $((SECONDS - start))
}

# How many mutants were refuted.
note() {
  local all refuted stops same expected
  all=$(find "$state/rows" -type f -name 'mutant-*' | wc -l)
  refuted=$(find "$state/rows" -type f -name 'mutant-*' -exec cut -f4 {} + | grep -c '^[1-9]' || true)
  stops=$(find "$state/rows" -type f -name 'mutant-*' -exec cut -f4 {} + | grep -c '^stops' || true)
  same=$(find "$state/rows" -type f -name 'mutant-*' -exec cut -f4 {} + | grep -c '^makes the same' || true)
  expected=$(find "$state/rows" -type f -name 'mutant-*' -exec cut -f4 {} + | grep -c ', as its patch says' || true)
  echo "$refuted of $all mutants refuted, $stops stopped by the verifier; $same make nothing else of any module, $expected of them as their patches say"
}
