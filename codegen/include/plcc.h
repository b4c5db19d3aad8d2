/* What an object made by `plcc build --emit obj` exports, and how to call it.
 *
 * The program's whole state is one block of plcc_image_size bytes, zeros at first; plcc_layout
 * says as text what is where in it. A scan of a task:
 *
 *     static uint8_t image[...];
 *     struct plcc_context context = { image, my_host, my_data };
 *     struct plcc_task task = plcc_task_at(0);
 *     switch (plcc_scan(&task, &context)) { ... }
 *
 * Compiled code accesses the image and calls the host function, nothing else. What the control did
 * around the program (timers, latching of inputs, slices) is up to the caller. The Rust crate
 * plcc-runtime does it for artifacts.
 */
#ifndef PLCC_H
#define PLCC_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* What compiled code gets. */
struct plcc_context {
    /* The program's state: plcc_image_size bytes. */
    uint8_t *image;
    /* Does what the program calls: the number of a function (HostFn in abi/src/host.rs lists them)
     * and four arguments; integers are zero-extended, doubles passed as their bits. For a program
     * that calls none it may be a function that returns 0. */
    uint64_t (*host)(const struct plcc_context *, uint32_t function, uint64_t, uint64_t, uint64_t,
                     uint64_t);
    /* For the host function; compiled code does not use it. */
    void *host_data;
};

/* The code, and for each label the offset in it of the function to enter. */
extern const uint8_t plcc_code[];
extern const uint32_t plcc_abi_version;
extern const uint32_t plcc_image_size;
extern const uint32_t plcc_label_count;
extern const uint32_t plcc_labels[];
extern const uint32_t plcc_task_count;
extern const uint32_t plcc_tasks[];
extern const char plcc_layout[];

/* The places at which the program may be stopped, four numbers each: why (TrapCode in
 * abi/src/outcome.rs lists the codes), the source (an index into its files, the first being 0), the
 * line, and the array that was accessed: the offset of its first element in the image, or
 * 0xFFFFFFFF for none. */
extern const uint32_t plcc_trap_site_count;
extern const uint32_t plcc_trap_sites[];

/* How a scan ended. */
enum plcc_outcome { PLCC_END = 1, PLCC_SUSPENDED = 2, PLCC_TRAP = 3 };

/* A task, and where its next scan begins. */
struct plcc_task {
    uint32_t start; /* the label at which it begins */
    uint32_t next;  /* the label at which its next scan begins */
    uint32_t trap;  /* after PLCC_TRAP, why: TrapCode in abi/src/outcome.rs lists the codes */
    uint32_t trap_site;  /* after PLCC_TRAP, where: an index into plcc_trap_sites, by fours; as
                            large as plcc_trap_site_count if no statement is to blame */
    int16_t trap_index;  /* after PLCC_TRAP, the index with which the site's array was accessed */
};

/* The task with an index below plcc_task_count, in the order of plcc_layout. */
static inline struct plcc_task plcc_task_at(uint32_t index)
{
    struct plcc_task task = { plcc_tasks[index], plcc_tasks[index], 0, 0, 0 };
    return task;
}

/* Enters why and where a program was stopped, of which the outcome of a chunk tells: the site's number
 * and 1 in the bits from 40 on, or 0 and the trap code below. */
static inline enum plcc_outcome plcc_trapped(struct plcc_task *task, uint64_t outcome)
{
    uint32_t site = (uint32_t)(outcome >> 40);
    task->trap = (uint32_t)outcome;
    task->trap_site = plcc_trap_site_count;
    task->trap_index = 0;
    if (site > plcc_trap_site_count) {
        task->trap = 0;
    } else if (site > 0) {
        task->trap_site = site - 1;
        task->trap = plcc_trap_sites[4 * (site - 1)];
        task->trap_index = (int16_t)(uint16_t)outcome;
    }
    return PLCC_TRAP;
}

/* One scan, from the beginning or from where the last one was suspended. After PLCC_TRAP the
 * program is stopped; another scan would begin at the beginning. */
static inline enum plcc_outcome plcc_scan(struct plcc_task *task,
                                          const struct plcc_context *context)
{
    uint32_t label = task->next;
    task->next = task->start;
    for (;;) {
        uint64_t (*chunk)(const struct plcc_context *, uint32_t);
        uint64_t outcome;
        if (label >= plcc_label_count) {
            return plcc_trapped(task, 0);
        }
        chunk = (uint64_t (*)(const struct plcc_context *, uint32_t))(
            (uintptr_t)plcc_code + plcc_labels[label]);
        outcome = chunk(context, label);
        label = (uint32_t)outcome;
        switch (outcome >> 32 & 0xFF) {
        case 0: /* goes on at the label */
            break;
        case PLCC_END:
            return PLCC_END;
        case PLCC_SUSPENDED:
            task->next = label;
            return PLCC_SUSPENDED;
        default:
            return plcc_trapped(task, outcome);
        }
    }
}

#ifdef __cplusplus
}
#endif

#endif
