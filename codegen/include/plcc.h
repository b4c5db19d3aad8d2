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

/* How a scan ended. */
enum plcc_outcome { PLCC_END = 1, PLCC_SUSPENDED = 2, PLCC_TRAP = 3 };

/* A task, and where its next scan begins. */
struct plcc_task {
    uint32_t start; /* the label at which it begins */
    uint32_t next;  /* the label at which its next scan begins */
    uint32_t trap;  /* after PLCC_TRAP, why: TrapCode in abi/src/outcome.rs lists the codes */
};

/* The task with an index below plcc_task_count, in the order of plcc_layout. */
static inline struct plcc_task plcc_task_at(uint32_t index)
{
    struct plcc_task task = { plcc_tasks[index], plcc_tasks[index], 0 };
    return task;
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
            task->trap = 0;
            return PLCC_TRAP;
        }
        chunk = (uint64_t (*)(const struct plcc_context *, uint32_t))(
            (uintptr_t)plcc_code + plcc_labels[label]);
        outcome = chunk(context, label);
        label = (uint32_t)outcome;
        switch (outcome >> 32) {
        case 0: /* goes on at the label */
            break;
        case PLCC_END:
            return PLCC_END;
        case PLCC_SUSPENDED:
            task->next = label;
            return PLCC_SUSPENDED;
        default:
            task->trap = label;
            return PLCC_TRAP;
        }
    }
}

#ifdef __cplusplus
}
#endif

#endif
