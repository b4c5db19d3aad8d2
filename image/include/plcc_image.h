/* The image file of a control (plcrt --image FILE), for programs in C: whole ticks are read, and inputs
 * are given. docs/image.md explains the file byte by byte.
 *
 *     struct plcc_image image;
 *     if (plcc_image_open(&image, "/dev/shm/lathe", 1)) return 1;      // 1: also to give inputs
 *     const struct plcc_symbol *pump = plcc_image_find(&image, "PUMP");
 *     const struct plcc_symbol *ready = plcc_image_find(&image, "READY");
 *     if (!pump || !ready || plcc_inputs_begin(&image, "my driver")) return 1;
 *     if (plcc_inputs_claim(&image, ready)) return 1;                   // another process gives it
 *     for (;;) {
 *         plcc_image_read(&image);                                      // copies a whole tick
 *         double on = plcc_image_value(&image, pump);
 *         plcc_inputs_set(&image, ready, 1);
 *         plcc_inputs_publish(&image);                                  // the control takes all at once
 *     }
 *
 * Needs C11, Linux, and a little-endian processor. One struct plcc_image is for one thread. */
#ifndef PLCC_IMAGE_H
#define PLCC_IMAGE_H

#include <fcntl.h>
#include <stdatomic.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

enum plcc_direction { PLCC_INTERNAL, PLCC_INPUT, PLCC_OUTPUT };
enum plcc_class { PLCC_BIT, PLCC_S32, PLCC_FLOAT };
enum plcc_type { PLCC_LOGICAL, PLCC_INTEGER, PLCC_LONG, PLCC_DOUBLE, PLCC_WORD, PLCC_BITS, PLCC_SIGNED_BITS, PLCC_BCD };

/* Where a value lies in the process image. */
struct plcc_place { uint32_t offset; uint8_t type, bit, width, zero; };

/* An entry of the table of symbols. A line of width 0 is none. */
struct plcc_symbol {
    uint32_t name, name_length;
    struct plcc_place value, line;
    uint32_t elements, slot_plus_one;
    uint8_t direction, klass, zero[6];
    uint32_t unit, unit_length;
};

/* What is given for a slot: its value (an integer, or the bits of a double) and its serial number. */
struct plcc_given { uint64_t value, serial; };

struct plcc_image {
    unsigned char *file;               /* the mapped file */
    size_t size;
    unsigned char *image;              /* the process image of the tick that was read last */
    uint32_t image_size;
    uint64_t ticks, state;             /* of that tick */
    int mailbox;                       /* -1: gives no inputs */
    uint64_t owner, serial;
    struct plcc_given *given;          /* a value for each slot */
};

static inline uint64_t plcc_at(const struct plcc_image *image, uint64_t at) {
    return *(const uint64_t *)(image->file + at);
}
static inline _Atomic uint64_t *plcc_word(const struct plcc_image *image, uint64_t at) {
    return (_Atomic uint64_t *)(image->file + at);
}

static inline uint64_t plcc_area(const struct plcc_image *image, int field) {
    return plcc_at(image, plcc_at(image, 0x78) + 8u * (unsigned)field);
}

/* Whether `count` parts of `each` bytes at an offset lie within the file, where words may be read. */
static inline int plcc_fits(const struct plcc_image *image, uint64_t at, uint64_t count, uint64_t each) {
    return at % 8 == 0 && at <= image->size && (each == 0 || count <= (image->size - at) / each);
}
/* Whether process image, table of symbols and area of inputs lie within the file: it may be damaged. */
static inline int plcc_is_whole(const struct plcc_image *image) {
    uint64_t inputs = plcc_at(image, 0x78);
    if (!plcc_fits(image, plcc_at(image, 0x20), ((uint64_t)image->image_size + 7) / 8, 8)) return 0;
    if (!plcc_fits(image, plcc_at(image, 0x68), plcc_at(image, 0x70), sizeof(struct plcc_symbol))) return 0;
    if (!inputs) return 1;
    if (!plcc_fits(image, inputs, 8, 8)) return 0;
    uint64_t slots = plcc_area(image, 0), mailboxes = plcc_area(image, 1), each = plcc_area(image, 5);
    return plcc_fits(image, plcc_area(image, 2), slots, 8) && each % 8 == 0 && each >= 0x40 && mailboxes <= 64
        && slots <= (each - 0x40) / 48 && plcc_fits(image, plcc_area(image, 4), mailboxes, each);
}

/* Opens an image file; with `write`, also to give inputs. Gives 0, or -1 where it is none. */
static inline int plcc_image_open(struct plcc_image *image, const char *path, int write) {
    memset(image, 0, sizeof *image);
    image->mailbox = -1;
    struct stat about;
    int file = open(path, (write ? O_RDWR : O_RDONLY) | O_CLOEXEC);
    if (file < 0) return -1;
    void *map = MAP_FAILED;
    if (!fstat(file, &about) && about.st_size >= 4096) {
        image->size = (size_t)about.st_size;
        map = mmap(0, image->size, write ? PROT_READ | PROT_WRITE : PROT_READ, MAP_SHARED, file, 0);
    }
    close(file);
    if (map == MAP_FAILED) return -1;
    image->file = map;
    image->image_size = ((const uint32_t *)image->file)[0x1C / 4];
    if (memcmp(image->file, "PLCCIMG1\1", 9) == 0 && plcc_is_whole(image)) image->image = calloc(1, image->image_size + 8);
    if (image->image) return 0;
    munmap(map, image->size);
    return -1;
}

/* Copies a whole tick. Gives 0, or -1 where the control has died while it wrote one. */
static inline int plcc_image_read(struct plcc_image *image) {
    for (int tries = 0; tries < 100000; tries++) {
        uint64_t before = atomic_load_explicit(plcc_word(image, 0x80), memory_order_acquire);
        if (before & 1) continue;
        uint64_t from = plcc_at(image, 0x20);
        for (uint32_t at = 0; at < image->image_size; at += 8) {
            uint64_t word = atomic_load_explicit(plcc_word(image, from + at), memory_order_relaxed);
            memcpy(image->image + at, &word, 8);
        }
        image->ticks = atomic_load_explicit(plcc_word(image, 0x88), memory_order_relaxed);
        image->state = atomic_load_explicit(plcc_word(image, 0x98), memory_order_relaxed);
        atomic_thread_fence(memory_order_acquire);
        if (atomic_load_explicit(plcc_word(image, 0x80), memory_order_relaxed) == before) return 0;
    }
    return -1;
}

/* The number of symbols, and the symbol with a number; 0 where there is none. */
static inline uint64_t plcc_image_symbols(const struct plcc_image *image) { return plcc_at(image, 0x70); }
static inline const struct plcc_symbol *plcc_image_symbol(const struct plcc_image *image, uint64_t number) {
    if (number >= plcc_image_symbols(image)) return 0;
    return (const struct plcc_symbol *)(image->file + plcc_at(image, 0x68)) + number;
}
/* The name of a symbol, which has no zero after it: its length is symbol->name_length. */
static inline const char *plcc_image_name(const struct plcc_image *image, const struct plcc_symbol *symbol) {
    return (const char *)image->file + symbol->name;
}
static inline const struct plcc_symbol *plcc_image_find(const struct plcc_image *image, const char *name) {
    const struct plcc_symbol *symbol;
    for (uint64_t n = 0; (symbol = plcc_image_symbol(image, n)); n++)
        if (symbol->name_length == strlen(name) && symbol->name <= image->size
            && symbol->name_length <= image->size - symbol->name && !memcmp(plcc_image_name(image, symbol), name, symbol->name_length))
            return symbol;
    return 0;
}

static inline double plcc_place_value(const struct plcc_image *image, struct plcc_place place) {
    const unsigned char *at = image->image + place.offset;
    uint64_t bits = 0;
    int size = place.type == PLCC_DOUBLE ? 8 : place.type == PLCC_LONG ? 4
        : place.type == PLCC_INTEGER || place.type == PLCC_WORD ? 2
        : place.type == PLCC_LOGICAL ? 1 : (place.bit + place.width + 7) / 8;
    if ((uint64_t)place.offset + (unsigned)size > image->image_size) return 0;
    memcpy(&bits, at, (size_t)size);
    double number = 0;
    switch (place.type) {
    case PLCC_DOUBLE: memcpy(&number, &bits, 8); return number;
    case PLCC_LOGICAL: return bits != 0;
    case PLCC_INTEGER: return (int16_t)bits;
    case PLCC_WORD: return (double)bits;
    case PLCC_LONG: return (int32_t)bits;
    }
    bits = bits >> place.bit & ((UINT64_C(1) << place.width) - 1);
    if (place.type == PLCC_BITS) return (double)bits;
    if (place.type == PLCC_SIGNED_BITS) return (double)((int64_t)(bits << (64 - place.width)) >> (64 - place.width));
    for (double weight = 1; bits; bits >>= 4, weight *= 10) number += (double)(bits & 15) * weight;
    return number;
}
/* The value of a symbol in the tick that was read last: of an output what is on its lines, which have the
 * safe value when the program has been stopped; else the value that the program sees. */
static inline double plcc_image_value(const struct plcc_image *image, const struct plcc_symbol *symbol) {
    int lines = symbol->direction == PLCC_OUTPUT && symbol->line.width;
    return plcc_place_value(image, lines ? symbol->line : symbol->value);
}

static inline uint64_t plcc_mailbox(const struct plcc_image *image, int mailbox) {
    return plcc_area(image, 4) + (uint64_t)mailbox * plcc_area(image, 5);
}
static inline void plcc_count_claim(struct plcc_image *image) {
    atomic_fetch_add(plcc_word(image, plcc_at(image, 0x78) + 0x30), 1);
}
/* The lower half of the start time of a process; -1 where there is none. */
static inline int64_t plcc_start_time(uint32_t process) {
    char path[32], text[1024];
    snprintf(path, sizeof path, "/proc/%u/stat", process);
    FILE *file = fopen(path, "r");
    if (!file) return -1;
    size_t length = fread(text, 1, sizeof text - 1, file);
    fclose(file);
    text[length] = 0;
    char *field = strrchr(text, ')');
    if (!field || field[1] == 0 || field[2] == 'Z') return -1;
    for (int n = 0; n < 20; n++)
        if (!(field = strchr(field + 1, ' '))) return -1;
    return (int64_t)(strtoull(field, 0, 10) & 0xFFFFFFFF);
}
static inline int plcc_lives(uint64_t owner) {
    return owner && plcc_start_time((uint32_t)(owner >> 32)) == (int64_t)(owner & 0xFFFFFFFF);
}

/* Hands all values over. Gives 0, or -1 where another process has the mailbox. */
static inline int plcc_inputs_publish(struct plcc_image *image) {
    uint64_t mailbox = plcc_mailbox(image, image->mailbox), slots = plcc_area(image, 0);
    _Atomic uint64_t *state = plcc_word(image, mailbox + 8);
    if (atomic_load(plcc_word(image, mailbox)) != image->owner) return -1;
    uint64_t back = atomic_load_explicit(state, memory_order_acquire) >> 4 & 3;
    if (back > 2) return -1;
    uint64_t buffer = mailbox + 0x40 + back * slots * 16;
    for (uint64_t slot = 0; slot < slots; slot++) {
        atomic_store_explicit(plcc_word(image, buffer + slot * 16), image->given[slot].value, memory_order_relaxed);
        atomic_store_explicit(plcc_word(image, buffer + slot * 16 + 8), image->given[slot].serial, memory_order_relaxed);
    }
    uint64_t old = atomic_load(state), new;
    do new = (old & 3) | (old >> 4 & 3) << 2 | (old >> 2 & 3) << 4 | 1 << 6;
    while (!atomic_compare_exchange_weak(state, &old, new));
    return 0;
}

/* Takes a mailbox, under a name of at most 32 bytes. Gives 0, or -1 where none is free. */
static inline int plcc_inputs_begin(struct plcc_image *image, const char *name) {
    if (!plcc_at(image, 0x78)) return -1;
    uint64_t slots = plcc_area(image, 0);
    uint32_t process = (uint32_t)getpid();
    image->owner = (uint64_t)process << 32 | (uint64_t)(plcc_start_time(process) & 0xFFFFFFFF);
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    image->serial = (uint64_t)now.tv_sec * 1000000000u + (uint64_t)now.tv_nsec;
    image->given = calloc(slots + 1, sizeof *image->given);
    for (int mailbox = 0; image->given && mailbox < (int)plcc_area(image, 1); mailbox++) {
        _Atomic uint64_t *owner = plcc_word(image, plcc_mailbox(image, mailbox));
        uint64_t old = atomic_load(owner);
        if (plcc_lives(old) || !atomic_compare_exchange_strong(owner, &old, image->owner)) continue;
        image->mailbox = mailbox;
        for (uint64_t slot = 0; slot < slots; slot++) {
            uint64_t former = (uint64_t)mailbox + 1;
            atomic_compare_exchange_strong(plcc_word(image, plcc_area(image, 2) + slot * 8), &former, 0);
        }
        plcc_count_claim(image);
        char text[32] = {0};
        memcpy(text, name, strlen(name) < 32 ? strlen(name) : 32);
        memcpy(image->file + plcc_mailbox(image, mailbox) + 0x20, text, 32);
        atomic_store(plcc_word(image, plcc_mailbox(image, mailbox) + 0x10), 0);
        atomic_store(plcc_word(image, plcc_mailbox(image, mailbox) + 0x18), 0);
        return plcc_inputs_publish(image);
    }
    return -1;
}

/* Claims a variable. Gives 0, or -1 where it can't be given or another process that lives gives it. */
static inline int plcc_inputs_claim(struct plcc_image *image, const struct plcc_symbol *symbol) {
    if (image->mailbox < 0 || !symbol->slot_plus_one || symbol->slot_plus_one > plcc_area(image, 0)) return -1;
    _Atomic uint64_t *owner = plcc_word(image, plcc_area(image, 2) + (symbol->slot_plus_one - 1) * 8);
    uint64_t old = atomic_load(owner), own = (uint64_t)image->mailbox + 1;
    do {
        if (old && old != own && old <= plcc_area(image, 1)
            && plcc_lives(atomic_load(plcc_word(image, plcc_mailbox(image, (int)old - 1))))) return -1;
    } while (!atomic_compare_exchange_weak(owner, &old, own));
    plcc_count_claim(image);
    return 0;
}

/* Sets the value of a claimed variable, or says that it is the same and still current. The control takes it
 * after plcc_inputs_publish, if the variable can have it. */
static inline void plcc_inputs_set(struct plcc_image *image, const struct plcc_symbol *symbol, double value) {
    struct plcc_place place = symbol->line.width ? symbol->line : symbol->value;
    struct plcc_given *given = &image->given[symbol->slot_plus_one - 1];
    if (place.type == PLCC_DOUBLE) memcpy(&given->value, &value, 8);
    else given->value = (uint64_t)(int64_t)value;
    given->serial = ++image->serial;
}

/* Releases everything: the inputs take their safe values at once. */
static inline void plcc_image_close(struct plcc_image *image) {
    if (image->mailbox >= 0 && atomic_load(plcc_word(image, plcc_mailbox(image, image->mailbox))) == image->owner) {
        for (uint64_t slot = 0; slot < plcc_area(image, 0); slot++) {
            uint64_t own = (uint64_t)image->mailbox + 1;
            atomic_compare_exchange_strong(plcc_word(image, plcc_area(image, 2) + slot * 8), &own, 0);
        }
        plcc_count_claim(image);
        atomic_store(plcc_word(image, plcc_mailbox(image, image->mailbox)), 0);
    }
    munmap(image->file, image->size);
    free(image->image);
    free(image->given);
}
#endif
