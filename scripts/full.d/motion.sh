# Motion programs with PLCs beside them, in every engine: all must agree, and no motor goes faster than it may.
#
# FULL_SEEDS is the number of programs (1000 unless it is set), FULL_TICKS that of the ticks of each (100000). A unit is FULL_UNIT of
# them (25); its name is the seed of the first. Every fourth is of a Turbo PMAC, every second has arcs, PVT, splines and
# kinematics.
head=$'first seed\tprograms\tticks of each\tresult\tseconds'

unit_size=${FULL_UNIT:-25}
ticks=${FULL_TICKS:-100000}

units() { seq 0 "$unit_size" $((${FULL_SEEDS:-1000} - 1)); }

unit() {
  local start=$SECONDS result=agree
  PLCC_SEEDS=$unit_size PLCC_FIRST=$1 PLCC_TICKS=$ticks \
    cargo test --release --locked -p plcc-tests --test pmac -- --nocapture motion::generated_motion_programs >&2 \
    || result="**differ, see logs/$1**"
  tests_ran "$1" || return 1
  printf '%s\t%s\t%s\t%s\t%s\n' "$1" "$unit_size" "$ticks" "$result" $((SECONDS - start))
}
