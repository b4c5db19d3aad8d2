# Lets the power fail at a million moments of saving retained data: the newest saved state is found.
#
# FULL_STATES is the number of crash states in thousands (1000 unless it is set). A unit is 100 000
# of them, made with and without errors of the disk; its name is the number of its first one in
# thousands, such as 100k. The unit `killed` ends 500 processes by SIGKILL while they save.
head=$'crash states from\tresult\tseconds'

# A case of host/src/retain/crash_states.rs looks at so many states.
states_per_case=20

units() {
  local first
  for ((first = 0; first < ${FULL_STATES:-1000}; first += 100)); do echo "${first}k"; done
  echo killed
}

unit() {
  local start=$SECONDS result="the newest saved state is found" cases=$((100000 / states_per_case))
  if [ "$1" = killed ]; then
    PLCC_KILLS=${FULL_KILLS:-500} cargo test --release --locked -p plcc-tests --test retained \
      a_process_that_is_killed >&2 || result="**lost, see logs/$1**"
  else
    PLCC_CRASH_CASES=$cases PLCC_FIRST=$((10#${1%k} * 1000 / states_per_case)) \
      cargo test --release --locked -p plcc-host --lib after_a_power_failure >&2 \
      || result="**lost, see logs/$1**"
  fi
  tests_ran "$1" || return 1
  printf '%s\t%s\t%s\n' "$1" "$result" $((SECONDS - start))
}
