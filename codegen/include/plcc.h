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
 * Compiled code reaches the image and the host function, nothing else. What the control did
 * around the program (timers, latching, slices) is yours to do, or use plcc_runtime.
 */
#ifndef PLCC_H
#define PLCC_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

struct plcc_context {
    uint8_t *image;
    /* The functions a program may call: number and four arguments, integers zero-extended,
     * doubles as their bits. May be a function that returns 0 where a program calls none. */
    uint64_t (*host)(const struct plcc_context *, uint32_t function, uint64_t, uint64_t, uint64_t,
                     uint64_t);
    void *host_data;
};

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

/* A task, and where it goes on. */
struct plcc_task {
    uint32_t start;
    uint32_t next;
    uint32_t trap; /* the code, after PLCC_TRAP */
};

static inline struct plcc_task plcc_task_at(uint32_t index)
{
    struct plcc_task task = { plcc_tasks[index], plcc_tasks[index], 0 };
    return task;
}

/* One scan, from the top or from where the last one was suspended. */
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
        case 0:
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
