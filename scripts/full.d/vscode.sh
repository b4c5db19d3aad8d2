# The extension in a real VS Code: each of its features in each language, as a user's keys and mouse reach it.
#
# Needs npm; code-server, which has the whole of VS Code in it, is installed from there, once for all runs. A unit is one run of tests/vscode.
head=$'unit\tresult\tseconds'

units() { seq 1 2; }

unit() {
  local start=$SECONDS result
  mkdir -p "$state/shots"
  (cd "$tree" && cargo build --locked --release -p plcc \
    && PLCC=$CARGO_TARGET_DIR/release/plcc EDITOR_FOLDER=$state/editor SHOTS=$state/shots tests/vscode/run) \
    2>&1 | tee "$state/$1.txt" >&2
  result=$(grep -E '^# (pass|fail) ' "$state/$1.txt" | tr -d '#' | tr '\n' ' ')
  grep -q '^# fail 0$' "$state/$1.txt" || return 1
  printf '%s\t%s\t%s\n' "$1" "${result:-nothing ran}" $((SECONDS - start))
}
