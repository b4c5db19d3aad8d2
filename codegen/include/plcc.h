/* What an object made by `plcc build --emit obj` exports, and how to call it.
 *
 * The program's whole state is one block of plcc_image_size bytes, zeros at first; plcc_layout
 * says as text what is where in it. A scan of a task:
 *
 *     static uint8_t image[...];
 *     struct plcc_context context = { image, my_host, my_data, 0, 0 };
 *     struct plcc_task task = plcc_task_at(0);
 *     switch (plcc_scan(&task, &context)) { ... }
 *
 * Compiled code accesses the image and calls the host function, nothing else. What the control did
 * around the program (timers, latching of inputs, slices) is up to the caller. The library libplcrt
 * does it for artifacts.
 *
 * Several programs in one: objects made with `--prefix pump` and `--prefix door` export pump_code,
 * door_code and so on. Include this file once for each, with its prefix defined:
 *
 *     #define PLCC_PREFIX pump
 *     #include "plcc.h"
 *     #define PLCC_PREFIX door
 *     #include "plcc.h"
 *
 *     struct plcc_task task = pump_task_at(0);
 *     pump_scan(&task, &context);
 */
#ifndef PLCC_H
#define PLCC_H

#include <stdint.h>

/* What compiled code gets. */
struct plcc_context {
    /* The program's state: plcc_image_size bytes. */
    uint8_t *image;
    /* Does what the program calls: the number of a function (docs/objects.md lists them) and four
     * arguments; integers are zero-extended, doubles passed as their bits. For a program that calls
     * none it may be a function that returns 0. */
    uint64_t (*host)(const struct plcc_context *, uint32_t function, uint64_t, uint64_t, uint64_t,
                     uint64_t);
    /* For the host function; compiled code does not use it. */
    void *host_data;
    /* A watchdog of the caller's: once *epoch has reached limit, the scan is stopped with the trap 5
     * (watchdog). Another thread may write *epoch. Compiled code looks at it where it jumps back, plcc_scan
     * between two chunks. Code that jumps back (NCT's does) needs an address here; plcc_scan puts that of
     * a number that stays 0 in the place of a null pointer. */
    const volatile uint64_t *epoch;
    uint64_t limit;
};

/* How a scan ended. */
enum plcc_outcome { PLCC_END = 1, PLCC_SUSPENDED = 2, PLCC_TRAP = 3 };

/* A task, and where its next scan begins. */
struct plcc_task {
    uint32_t start;      /* the label at which it begins */
    uint32_t next;       /* the label at which its next scan begins */
    uint32_t trap;       /* after PLCC_TRAP, why; docs/objects.md lists the codes */
    uint32_t trap_site;  /* after PLCC_TRAP, where: the number of a trap site, from 0; as large as
                            plcc_trap_site_count if no statement is to blame */
    int16_t trap_index;  /* after PLCC_TRAP, the index with which the site's array was accessed */
};

/* A place at which the program may be stopped. */
struct plcc_trap_site {
    uint32_t trap;  /* why */
    uint32_t file;  /* the source, an index into the program's files, the first being 0 */
    uint32_t line;  /* the line, from 1 */
    uint32_t array; /* the offset in the image of the array that is accessed; 0xFFFFFFFF for none */
};

/* A name of the program with the prefix that is defined. */
#define PLCC_JOINED(prefix, name) prefix##_##name
#define PLCC_WITH_PREFIX(prefix, name) PLCC_JOINED(prefix, name)
#define PLCC_NAME(name) PLCC_WITH_PREFIX(PLCC_PREFIX, name)

#endif

#if defined PLCC_PREFIX || !defined PLCC_DECLARED
#ifndef PLCC_PREFIX
#define PLCC_PREFIX plcc
#define PLCC_DECLARED
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* The code, and for each label the offset in it of the function to enter. */
extern const uint8_t PLCC_NAME(code)[];
extern const uint32_t PLCC_NAME(abi_version);
extern const uint32_t PLCC_NAME(image_size);
extern const uint32_t PLCC_NAME(label_count);
extern const uint32_t PLCC_NAME(labels)[];
extern const uint32_t PLCC_NAME(task_count);
extern const uint32_t PLCC_NAME(tasks)[];
extern const uint32_t PLCC_NAME(trap_site_count);
extern const struct plcc_trap_site PLCC_NAME(trap_sites)[];
extern const char PLCC_NAME(layout)[];

/* The task with an index below plcc_task_count, in the order of plcc_layout. */
static inline struct plcc_task PLCC_NAME(task_at)(uint32_t index)
{
    struct plcc_task task = { PLCC_NAME(tasks)[index], PLCC_NAME(tasks)[index], 0, 0, 0 };
    return task;
}

/* Enters into the task why and where its program was stopped. The outcome of a chunk has, from bit 40 on,
 * 1 more than the number of the trap site, or 0 there and the trap code in the low 32 bits. */
static inline enum plcc_outcome PLCC_NAME(trapped)(struct plcc_task *task, uint64_t outcome)
{
    uint32_t site = (uint32_t)(outcome >> 40);
    task->trap = (uint32_t)outcome;
    task->trap_site = PLCC_NAME(trap_site_count);
    task->trap_index = 0;
    if (site > PLCC_NAME(trap_site_count)) {
        task->trap = 0;
    } else if (site > 0) {
        task->trap_site = site - 1;
        task->trap = PLCC_NAME(trap_sites)[site - 1].trap;
        task->trap_index = (int16_t)(uint16_t)outcome;
    }
    return PLCC_TRAP;
}

/* One scan, from the beginning or from where the last one was suspended. After PLCC_TRAP the
 * program is stopped; another scan would begin at the beginning. */
static inline enum plcc_outcome PLCC_NAME(scan)(struct plcc_task *task,
                                                const struct plcc_context *context)
{
    static const volatile uint64_t never = 0;
    struct plcc_context unlimited;
    uint32_t label = task->next;
    task->next = task->start;
    if (!context->epoch) {
        unlimited = *context;
        unlimited.epoch = &never;
        unlimited.limit = 1;
        context = &unlimited;
    }
    for (;;) {
        uint64_t (*chunk)(const struct plcc_context *, uint32_t);
        uint64_t outcome;
        if (label >= PLCC_NAME(label_count))
            return PLCC_NAME(trapped)(task, 0);
        chunk = (uint64_t (*)(const struct plcc_context *, uint32_t))(
            (uintptr_t)PLCC_NAME(code) + PLCC_NAME(labels)[label]);
        outcome = chunk(context, label);
        label = (uint32_t)outcome;
        switch (outcome >> 32 & 0xFF) {
        case 0: /* goes on at the label */
            if (*context->epoch >= context->limit)
                return PLCC_NAME(trapped)(task, 5);
            break;
        case PLCC_END:
            return PLCC_END;
        case PLCC_SUSPENDED:
            task->next = label;
            return PLCC_SUSPENDED;
        default:
            return PLCC_NAME(trapped)(task, outcome);
        }
    }
}

#ifdef __cplusplus
}
#endif

#undef PLCC_PREFIX
#endif
