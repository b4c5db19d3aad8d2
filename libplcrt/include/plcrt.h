/* The C interface of libplcrt: runs programs that plcc has compiled.
 *
 * Made by cbindgen of libplcrt/src/c.rs: change that file, not this one.
 */

#ifndef PLCRT_H
#define PLCRT_H

#include <stdarg.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>

// For plcrt_find: the variable is looked up to read it.
#define PLCRT_READ 0

// For plcrt_find: the variable is looked up to set it.
#define PLCRT_WRITE 1

// For plcrt_find: an output is looked up to read what is on its physical lines.
#define PLCRT_LINES 2

// The result of a function that can fail.
enum plcrt_status {
  // Done.
  PLCRT_OK = 0,
  // The control has stopped the program, now or before.
  PLCRT_STOPPED = 1,
  // Not done; plcrt_error says why.
  PLCRT_FAILED = -1,
};

// A control with its program. It may be used by one thread at a time.
struct plcrt;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// The text of the last error on this thread; empty if there was none. It is valid until the next
// function of this library that this thread calls.
const char *plcrt_error(void);

// A control at power-up with the program of a file that `plcc build` has written. `options` are those
// of `plcrt` under "Control", separated by blanks (`--period 10`), or null. Null if it fails.
//
// # Safety
// Both pointers are null or point to texts that end with a zero.
struct plcrt *plcrt_open(const char *path,
                         const char *options);

// The same as plcrt_open, with the `length` bytes of a file in memory, which are not needed
// afterwards.
//
// # Safety
// `bytes` is null or points to `length` bytes; `options` is null or a text that ends with a zero.
struct plcrt *plcrt_load(const uint8_t *bytes, uintptr_t length, const char *options);

// Gives a control's memory back. Null does nothing.
//
// # Safety
// `control` is null or was given by plcrt_open or plcrt_load; it is not used afterwards.
void plcrt_close(struct plcrt *control);

// Does one base tick: a PMI scan, an NCT slice of 20 ms, a PMAC servo cycle. The library does not look
// at the clock: call it when a tick is due.
//
// # Safety
// `control` is null or open, and no other thread uses it.
enum plcrt_status plcrt_tick(struct plcrt *control);

// Gives the lines of the outputs their safe values, as a stop does, before the end of who uses the control.
//
// # Safety
// As for plcrt_tick.
enum plcrt_status plcrt_make_safe(struct plcrt *control);

// How many ticks have been begun; 0 for null.
//
// # Safety
// As for plcrt_tick.
uint64_t plcrt_ticks(struct plcrt *control);

// The length of a tick in nanoseconds of the control's time; 0 for null. A PMAC program may change it.
//
// # Safety
// As for plcrt_tick.
uint64_t plcrt_tick_ns(struct plcrt *control);

// Finds a variable by its name as the control's users know it, and gives its number for plcrt_read
// (`purpose` PLCRT_READ) or plcrt_write (PLCRT_WRITE); -1 if it fails. Each call gives a new number, so a
// variable is best found once. With PLCRT_LINES plcrt_read reads what a machine gets of an output: safe values when the
// program is stopped, while the variable keeps its own; of what has no lines the same as with PLCRT_READ.
//
// # Safety
// As for plcrt_tick; `name` is null or a text that ends with a zero.
int64_t plcrt_find(struct plcrt *control,
                   const char *name,
                   uint32_t purpose);

// Writes the value of a variable that was found with PLCRT_READ or PLCRT_LINES to `value`; of an array the element
// with this index, from 0. For a variable that is not an array `index` must be 0. Integers of a control
// have at most 48 bits, so a double holds them exactly.
//
// # Safety
// As for plcrt_tick; `value` is null or points to a double.
enum plcrt_status plcrt_read(struct plcrt *control,
                             int64_t variable,
                             uint32_t index,
                             double *value);

// The number of elements of a variable found with PLCRT_READ or PLCRT_LINES: 1 if it is not an array, 0 if it fails.
//
// # Safety
// As for plcrt_tick.
uint32_t plcrt_elements(struct plcrt *control,
                        int64_t variable);

// Sets a variable that was found with PLCRT_WRITE, as the machine or the operator would: the value
// is converted as in an assignment of the program. It fails for a value that is not finite, and for
// a fraction unless the control is a PMAC.
//
// # Safety
// As for plcrt_tick.
enum plcrt_status plcrt_write(struct plcrt *control, int64_t variable, double value);

// Writes the value of the variable `name` to `value`; `A[3]` names an element of an array.
//
// # Safety
// As for plcrt_find and plcrt_read.
enum plcrt_status plcrt_get(struct plcrt *control, const char *name, double *value);

// Sets a variable by its name; see plcrt_write.
//
// # Safety
// As for plcrt_find.
enum plcrt_status plcrt_set(struct plcrt *control, const char *name, double value);

// The oldest event that was not taken yet, as one JSON object, valid until the next function with this
// control; null if there is none. At most 65 536 events wait; then the oldest is lost.
//
// # Safety
// As for plcrt_tick.
const char *plcrt_next_event(struct plcrt *control);

// Says whether events are kept from now on; they are at first. Without them, plcrt_tick, plcrt_read and
// plcrt_write neither allocate memory nor call the operating system once the first tick is done, so that a
// thread with real-time priority may call them. Two things do: the tick in which the program is stopped,
// and an error.
//
// # Safety
// As for plcrt_tick.
enum plcrt_status plcrt_keep_events(struct plcrt *control,
                                    bool keep);

// Why the program was stopped, for people: the control's code and a sentence. Null if it was not stopped.
// The text is valid until the next function with this control.
//
// # Safety
// As for plcrt_tick.
const char *plcrt_stop_message(struct plcrt *control);

// How many events were lost; 0 for null.
//
// # Safety
// As for plcrt_tick.
uint64_t plcrt_lost_events(struct plcrt *control);

// From now on plcrt_tick calls `callback` for each event, and plcrt_next_event gives none. If
// `callback` is null, that ends. `user` is passed on to it; `json` is one JSON object as
// `plcrt --events` writes it, valid during the call. The callback must not use the control.
//
// # Safety
// As for plcrt_tick. The function may be called with `user` as long as the control is open.
enum plcrt_status plcrt_on_event(struct plcrt *control,
                                 void (*callback)(void *user, const char *json),
                                 void *user);

// The state as `plcrt --dump` writes it, one JSON object, valid until the next function with this
// control: `state`, why the program was stopped, all variables. Null if it fails.
//
// # Safety
// As for plcrt_tick.
const char *plcrt_dump(struct plcrt *control);

// Copies the data that survives power-off to `buffer` if it is at most `size` bytes long. Gives its
// length in bytes, 0 where the program keeps none, -1 if it fails. `buffer` may be null to ask for the
// length.
//
// # Safety
// As for plcrt_tick; `buffer` is null or points to `size` bytes.
int64_t plcrt_retained(struct plcrt *control,
                       uint8_t *buffer,
                       uintptr_t size);

// Takes back the data that plcrt_retained gave, before the first tick.
//
// # Safety
// As for plcrt_tick; `bytes` is null or points to `length` bytes.
enum plcrt_status plcrt_restore(struct plcrt *control, const uint8_t *bytes, uintptr_t length);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* PLCRT_H */
