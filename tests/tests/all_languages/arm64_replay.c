/* Replays the scans that were recorded on the machine that made this test, on the machine that runs it,
 * and compares. A file for each program holds records, numbers little endian:
 *
 *     W offset length bytes    a change of the image
 *     S task label             a scan of the task begins at the label. What it changes follows, up to
 *     H function args result   a call of the host, with four arguments. What the host changes follows,
 *                              and a byte 0; then the scan goes on
 *     E kind payload line index    the scan has ended: an outcome, the label at which the task goes on or
 *                              the trap code, line and index of a trap. What happens between two
 *                              scans follows
 *     Q                        the end
 *
 * Two NaNs at one place are the same, since processors make different ones. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

PROGRAMS

struct program {
    const char *name;
    const uint32_t *image_size;
    struct plcc_task (*task_at)(uint32_t);
    enum plcc_outcome (*scan)(struct plcc_task *, const struct plcc_context *);
    const struct plcc_trap_site *sites;
    const uint32_t *site_count;
};

static FILE *records;
static const char *name;
static unsigned long scans, calls;
/* The image of the program, and what it must be at the next comparison. */
static uint8_t *image, *expected;
static uint32_t size;

static void fail(const char *what)
{
    printf("%s, scan %lu, call %lu: %s\n", name, scans, calls, what);
    exit(1);
}

static uint64_t number(int bytes)
{
    uint64_t value = 0;
    int i;
    for (i = 0; i < bytes; i++)
        value |= (uint64_t)(uint8_t)getc(records) << 8 * i;
    return value;
}

/* Reads changes up to a record that is none, and gives that. They happen in `expected`, and if
 * something else than the scan made them, in the image too. */
static int changes(int both)
{
    int kind;
    while ((kind = getc(records)) == 'W') {
        uint32_t offset = number(4), length = number(4);
        if (offset > size || length > size - offset)
            fail("a change outside the image");
        if (fread(expected + offset, 1, length, records) != length)
            fail("the records end too early");
        if (both)
            memcpy(image + offset, expected + offset, length);
    }
    return kind;
}

static int is_nan(const uint8_t *bytes)
{
    double value;
    memcpy(&value, bytes, 8);
    return value != value;
}

static void compare(const char *when)
{
    uint32_t at;
    for (at = 0; at < size; at++) {
        uint32_t word = at & ~7u;
        char text[100];
        if (image[at] == expected[at])
            continue;
        if (word + 8 <= size && is_nan(image + word) && is_nan(expected + word)) {
            memcpy(image + word, expected + word, 8);
            continue;
        }
        sprintf(text, "%s: byte %" PRIu32 " is %d, not %d", when, at, image[at], expected[at]);
        fail(text);
    }
}

static uint64_t host(const struct plcc_context *context, uint32_t function, uint64_t a, uint64_t b,
                     uint64_t c, uint64_t d)
{
    uint64_t given[4], result;
    int i, kind;
    (void)context;
    given[0] = a, given[1] = b, given[2] = c, given[3] = d;
    calls++;
    /* The changes of the scan before this call. */
    if (changes(0) != 'H')
        fail("the host is called once too often");
    compare("before a call of the host");
    if (number(4) != function)
        fail("another function of the host is called");
    for (i = 0; i < 4; i++) {
        uint64_t wanted = number(8);
        if (given[i] != wanted && !(is_nan((uint8_t *)&given[i]) && is_nan((uint8_t *)&wanted)))
            fail("the host is called with something else");
    }
    result = number(8);
    kind = changes(1);
    if (kind != 0)
        fail("a record is not understood");
    return result;
}

static void replay(const struct program *program, const char *file)
{
    struct plcc_context context;
    int kind;
    name = program->name;
    size = *program->image_size;
    scans = calls = 0;
    image = calloc(size + 8, 1);
    expected = calloc(size + 8, 1);
    records = fopen(file, "rb");
    if (!image || !expected || !records)
        fail("no memory, or no records");
    memset(&context, 0, sizeof context);
    context.image = image, context.host = host;
    while ((kind = changes(1)) == 'S') {
        struct plcc_task task = program->task_at(number(4));
        enum plcc_outcome outcome;
        uint32_t payload, line = 0, index = 0;
        task.next = number(4);
        scans++;
        outcome = program->scan(&task, &context);
        if (changes(0) != 'E')
            fail("the host is not called once more");
        compare("at the end of the scan");
        payload = outcome == PLCC_TRAP ? task.trap : outcome == PLCC_SUSPENDED ? task.next : 0;
        if (outcome == PLCC_TRAP && task.trap_site < *program->site_count) {
            line = program->sites[task.trap_site].line;
            if (program->sites[task.trap_site].array != 0xFFFFFFFF)
                index = (uint16_t)task.trap_index;
        }
        if (number(4) != outcome || number(4) != payload || number(4) != line || number(4) != index)
            fail("the scan ends in another way");
    }
    if (kind != 'Q')
        fail("a record is not understood");
    printf("%s: %lu scans\n", name, scans);
    fclose(records);
    free(image);
    free(expected);
}

static const struct program programs[] = { TABLE };

int main(int argc, char **argv)
{
    int i;
    for (i = 1; i < argc; i++)
        replay(&programs[i - 1], argv[i]);
    return 0;
}
