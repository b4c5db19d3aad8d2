/* COMPONENT: SOURCE as a component for LinuxCNC's HAL. Made by `plcc hal`; make it again rather than change it.
 *
 *     make && sudo make install
 *     halcmd loadrt COMPONENT [options="--period 10"] [retain=/var/lib/COMPONENT.retained]
 *     halcmd addf COMPONENT.tick THREAD
 *
 * COMPONENT.tick is called in every period of its thread. It does a tick of the control (a PMI scan, an NCT
 * slice, a PMAC servo cycle) whenever one is due by the thread's period: it gives the program the input pins
 * that have changed, executes the tick, and sets the output pins.
 */
#include "rtapi.h"
#include "rtapi_app.h"
#include "hal.h"

#include "plcrt.h"

#include <errno.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

MODULE_AUTHOR("plcc");
MODULE_DESCRIPTION("SOURCE, a PLC program");
MODULE_LICENSE("GPL");

static char *options = "";
RTAPI_MP_STRING(options, "options of the control, as plcrt has them: --period 10");
static char *retain = "";
RTAPI_MP_STRING(retain, "the file that holds what survives power-off");

/* The artifact. */
__asm__(".pushsection .rodata\n"
        "plcx_begin: .incbin \"COMPONENT.plcx\"\n"
        "plcx_end: .byte 0\n"
        ".popsection\n");
extern const uint8_t plcx_begin[] __attribute__((visibility("hidden")));
extern const uint8_t plcx_end[] __attribute__((visibility("hidden")));

/* The pins: the program's variable; the pin's name, without that of the component before it; type; direction; the
 * least and the greatest value that the variable can have. */
static const struct pin {
    const char *variable;
    const char *name;
    hal_type_t type;
    hal_pin_dir_t dir;
    double low;
    double high;
} pins[] = {
PINS};
enum { PIN_COUNT = sizeof pins / sizeof *pins };

/* Where HAL keeps the pins' values, in its shared memory. */
struct values {
    union {
        hal_bit_t *bit;
        hal_s32_t *s32;
        hal_float_t *real;
        void *any;
    } pin[PIN_COUNT];
    hal_bit_t *stopped;       /* the control has stopped the program */
    hal_u32_t *ticks;         /* how many ticks were begun */
    hal_s32_t tick_time;      /* how long the last tick took, in ns */
    hal_s32_t tick_time_max;  /* the longest; may be set to 0 */
};

static struct values *values;
static struct plcrt *control;
static int component = -1;
static int64_t readers[PIN_COUNT];
static int64_t writers[PIN_COUNT];
/* The value that each pin had when it was last read or set here. */
static double last[PIN_COUNT];
/* Whether an input pin has a value that its variable can't have. */
static bool refused[PIN_COUNT];
/* Whether the component is being unloaded, and whether the thread is in its function. */
static volatile bool leaving, working;
/* How much time has passed since the last tick was due, in ns; -1 before the first one. */
static int64_t elapsed = -1;

static double get(int n)
{
    switch (pins[n].type) {
    case HAL_BIT: return *values->pin[n].bit ? 1 : 0;
    case HAL_S32: return *values->pin[n].s32;
    default: return *values->pin[n].real;
    }
}

static void set(int n, double value)
{
    switch (pins[n].type) {
    case HAL_BIT: *values->pin[n].bit = value != 0; break;
    case HAL_S32:
        /* A variable of a control can have more bits than the pin. */
        *values->pin[n].s32 = value < INT32_MIN ? INT32_MIN : value > INT32_MAX ? INT32_MAX : (hal_s32_t)value;
        break;
    default: *values->pin[n].real = value; break;
    }
}

/* Sets output pins to what the program's variables are. */
static void set_outputs(void)
{
    for (int n = 0; n < PIN_COUNT; n++) {
        double value;
        if (pins[n].dir != HAL_IN && plcrt_read(control, readers[n], 0, &value) == PLCRT_OK
            && value != last[n]) {
            last[n] = value;
            set(n, value);
        }
    }
}

/* Gives the program the input pins that have changed. A value that the variable can't have is not taken: the variable
 * keeps the last one that it could have, and a message says so once. */
static void take_inputs(void)
{
    for (int n = 0; n < PIN_COUNT; n++) {
        double value = get(n);
        if (pins[n].dir == HAL_OUT || value == last[n])
            continue;
        /* A comparison with NaN is false. */
        if (value >= pins[n].low && value <= pins[n].high
            && plcrt_write(control, writers[n], value) == PLCRT_OK) {
            last[n] = value;
            refused[n] = false;
        } else if (!refused[n]) {
            refused[n] = true;
            rtapi_print_msg(RTAPI_MSG_ERR,
                            "COMPONENT: the pin COMPONENT.%s is %.15g, which %s can't be (%.15g to %.15g); %s "
                            "keeps its last value\n",
                            pins[n].name, value, pins[n].variable, pins[n].low, pins[n].high, pins[n].variable);
        }
    }
}

static void one_tick(void)
{
    take_inputs();
    if (plcrt_tick(control) != PLCRT_OK && !*values->stopped) {
        const char *why = plcrt_stop_message(control);
        *values->stopped = 1;
        rtapi_print_msg(RTAPI_MSG_ERR, "COMPONENT: the program is stopped: %s\n",
                        why ? why : plcrt_error());
    }
    *values->ticks = (hal_u32_t)plcrt_ticks(control);
    set_outputs();
}

static void tick(void *unused, long period)
{
    int64_t due = (int64_t)plcrt_tick_ns(control);
    (void)unused;
    __atomic_store_n(&working, true, __ATOMIC_SEQ_CST);
    if (__atomic_load_n(&leaving, __ATOMIC_SEQ_CST))
        due = 0;
    /* The first tick is due at once. */
    elapsed = elapsed < 0 ? due : elapsed + period;
    while (elapsed >= due && due > 0) {
        long long begin = rtapi_get_time();
        long long time;
        elapsed -= due;
        one_tick();
        time = rtapi_get_time() - begin;
        values->tick_time = (hal_s32_t)time;
        if (time > values->tick_time_max)
            values->tick_time_max = (hal_s32_t)time;
        due = (int64_t)plcrt_tick_ns(control);
    }
    __atomic_store_n(&working, false, __ATOMIC_SEQ_CST);
}

/* Has the outputs take their safe values before their pins go, since signals keep the last value of a pin. */
static void leave(void)
{
    __atomic_store_n(&leaving, true, __ATOMIC_SEQ_CST);
    /* The thread ends what it has begun. */
    for (int rounds = 0; rounds < 1000 && __atomic_load_n(&working, __ATOMIC_SEQ_CST); rounds++)
        usleep(1000);
    plcrt_make_safe(control);
    set_outputs();
}

static int failed(const char *what)
{
    rtapi_print_msg(RTAPI_MSG_ERR, "COMPONENT: %s: %s\n", what, plcrt_error());
    return -1;
}

/* The name of the file to which the retained data is written before it replaces the one that `retain` names. */
static int new_file(char *path, size_t size)
{
    int length = snprintf(path, size, "%s.new", retain);
    return length > 0 && (size_t)length < size ? 0 : -1;
}

/* Restores the retained data from the file that `retain` names. It is no error if there is no such file yet, but it is
 * one if it could not be made when the component is unloaded. */
static int restore(void)
{
    static uint8_t bytes[1 << 20];
    char path[512];
    FILE *file;
    size_t length;
    bool complete;
    if (!*retain)
        return 0;
    if (new_file(path, sizeof path) != 0 || !(file = fopen(path, "wb"))) {
        rtapi_print_msg(RTAPI_MSG_ERR, "COMPONENT: retain=%s: the file %s.new can't be written: %s\n", retain, retain,
                        strerror(errno));
        return -1;
    }
    fclose(file);
    remove(path);
    file = fopen(retain, "rb");
    if (!file && errno == ENOENT)
        return 0;
    length = file ? fread(bytes, 1, sizeof bytes, file) : 0;
    complete = file && !ferror(file) && length < sizeof bytes;
    if (!complete)
        rtapi_print_msg(RTAPI_MSG_ERR, "COMPONENT: retain=%s can't be read: %s\n", retain,
                        length == sizeof bytes ? "it is too long" : strerror(errno));
    if (file)
        fclose(file);
    if (!complete)
        return -1;
    return plcrt_restore(control, bytes, length) == PLCRT_OK ? 0 : failed(retain);
}

/* Writes the retained data to a new file, which then replaces the one that `retain` names. */
static void save(void)
{
    static uint8_t bytes[1 << 20];
    char path[512];
    int64_t length = *retain ? plcrt_retained(control, bytes, sizeof bytes) : 0;
    FILE *file;
    if (length < 0)
        failed(retain);
    if (length > (int64_t)sizeof bytes)
        rtapi_print_msg(RTAPI_MSG_ERR, "COMPONENT: %s is not written: it would be too long\n", retain);
    if (length <= 0 || length > (int64_t)sizeof bytes)
        return;
    file = new_file(path, sizeof path) == 0 ? fopen(path, "wb") : NULL;
    if (!file || fwrite(bytes, 1, (size_t)length, file) != (size_t)length || fflush(file) != 0
        || fclose(file) != 0 || rename(path, retain) != 0)
        rtapi_print_msg(RTAPI_MSG_ERR, "COMPONENT: %s can't be written\n", retain);
}

static int start(void)
{
    control = plcrt_load(plcx_begin, (size_t)(plcx_end - plcx_begin), options);
    if (!control)
        return failed("the program can't be loaded");
    /* From now on a tick allocates no memory and calls nothing of the operating system. */
    plcrt_keep_events(control, false);
    if (restore() != 0)
        return -1;
    values = hal_malloc(sizeof *values);
    if (!values)
        return failed("HAL has no memory");
    for (int n = 0; n < PIN_COUNT; n++) {
        char name[HAL_NAME_LEN + 1];
        if (rtapi_snprintf(name, sizeof name, "COMPONENT.%s", pins[n].name) > HAL_NAME_LEN)
            return failed(pins[n].name);
        if (hal_pin_new(name, pins[n].type, pins[n].dir, &values->pin[n].any, component) != 0)
            return failed(name);
        /* Of an output it is what is on its lines: they are safe when the program is stopped. */
        readers[n] = plcrt_find(control, pins[n].variable, pins[n].dir == HAL_OUT ? PLCRT_LINES : PLCRT_READ);
        writers[n] = pins[n].dir == HAL_OUT ? 0 : plcrt_find(control, pins[n].variable, PLCRT_WRITE);
        if (readers[n] < 0 || writers[n] < 0
            || plcrt_read(control, readers[n], 0, &last[n]) != PLCRT_OK)
            return failed(pins[n].variable);
        /* A pin begins with the value that its variable has. */
        set(n, last[n]);
    }
    if (hal_pin_bit_newf(HAL_OUT, &values->stopped, component, "COMPONENT.stopped") != 0
        || hal_pin_u32_newf(HAL_OUT, &values->ticks, component, "COMPONENT.ticks") != 0
        || hal_param_s32_newf(HAL_RO, &values->tick_time, component, "COMPONENT.tick-time") != 0
        || hal_param_s32_newf(HAL_RW, &values->tick_time_max, component, "COMPONENT.tick-time-max")
               != 0)
        return failed("a pin can't be made");
    *values->stopped = 0;
    *values->ticks = 0;
    values->tick_time = values->tick_time_max = 0;
    return hal_export_funct("COMPONENT.tick", tick, NULL, 1, 0, component);
}

int rtapi_app_main(void)
{
    component = hal_init("COMPONENT");
    if (component < 0)
        return component;
    if (start() != 0) {
        plcrt_close(control);
        hal_exit(component);
        return -1;
    }
    return hal_ready(component);
}

void rtapi_app_exit(void)
{
    leave();
    hal_exit(component);
    save();
    plcrt_close(control);
}
