/* Runs a lathe's program for 2 seconds, played by an operator in C.
 *
 *     plcc build examples/pmi/lathe.pmi
 *     cc -I libplcrt/include libplcrt/examples/lathe.c -L target/release -lplcrt -o lathe
 *     LD_LIBRARY_PATH=target/release ./lathe lathe.plcx
 */
#include <stdio.h>
#include <stdlib.h>

#include "plcrt.h"

static void fail(const char *what)
{
    fprintf(stderr, "%s: %s\n", what, plcrt_error());
    exit(2);
}

static void print_event(void *count, const char *json)
{
    ++*(int *)count;
    printf("event %s\n", json);
}

/* What the operator does: switches the machine on, then presses the button. */
static const struct {
    unsigned tick;
    const char *name;
    double value;
} actions[] = {
    { 0, "@ESTOP", 1 },  { 5, "MCRDY", 1 },   { 10, "@CP115", 1 },
    { 14, "@ESTOP", 0 }, { 30, "@CP115", 0 },
};

int main(int argc, char **argv)
{
    struct plcrt *control = plcrt_open(argc > 1 ? argv[1] : "lathe.plcx", "--period 20");
    enum plcrt_status status = PLCRT_OK;
    int64_t machine_on, kept;
    int events = 0;
    size_t next = 0;
    double before = -1, value;

    if (!control)
        fail("the program can't be loaded");
    machine_on = plcrt_find(control, "MCHON", PLCRT_READ);
    kept = plcrt_find(control, "@NVINT[3]", PLCRT_WRITE);
    if (machine_on < 0 || kept < 0)
        fail("a variable is missing");
    plcrt_on_event(control, print_event, &events);
    while (status == PLCRT_OK && plcrt_ticks(control) < 100) {
        /* Here a real program would wait until the tick is due, and read its inputs. */
        for (; next < sizeof actions / sizeof *actions
               && actions[next].tick == plcrt_ticks(control); next++)
            if (plcrt_set(control, actions[next].name, actions[next].value) != PLCRT_OK)
                fail(actions[next].name);
        if (plcrt_write(control, kept, (double)plcrt_ticks(control)) != PLCRT_OK)
            fail("@NVINT[3]");
        status = plcrt_tick(control);
        if (status == PLCRT_FAILED)
            fail("a tick");
        if (plcrt_read(control, machine_on, 0, &value) != PLCRT_OK)
            fail("MCHON");
        if (value != before)
            printf("tick %u: MCHON is %g\n", (unsigned)plcrt_ticks(control) - 1, value);
        before = value;
    }
    plcrt_get(control, "@NVINT[3]", &value);
    printf("%s after %u ticks of %u ms, %d events, @NVINT[3] is %g\n",
           status == PLCRT_OK ? "running" : "stopped", (unsigned)plcrt_ticks(control),
           (unsigned)(plcrt_tick_ns(control) / 1000000), events, value);
    if (status == PLCRT_STOPPED)
        printf("%s\n", plcrt_dump(control));
    plcrt_close(control);
    return status == PLCRT_OK ? 0 : 3;
}
