/* A chip of Linux's GPIO character device that exists for one process only, for computers without a real one and
 * without the kernel's gpio-sim: a library for LD_PRELOAD, which answers the system calls on /dev/gpiochip77 as the kernel
 * does, by the kernel's own header.
 *
 * The folder FAKE_GPIO holds the state: `inputs` and `outputs`, a character 0 or 1 for each of 8 lines; `flags`, where each request of
 * a line appends its number and its flags; and `conduct`: `gone`, `busy`, `hangs`, or nothing. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <linux/gpio.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <unistd.h>

#define LINES 8
#define FILES 1024

static const char CHIP[] = "/dev/gpiochip77";
/* The lines that belong to a file descriptor. */
static struct gpio_v2_line_request requests[FILES];

static const char *path_of(const char *name) {
    static _Thread_local char path[4096];
    snprintf(path, sizeof path, "%s/%s", getenv("FAKE_GPIO"), name);
    return path;
}

/* Reads a file of the folder, as much as fits; an absent one is empty. */
static void load(const char *name, char *text, size_t size) {
    memset(text, 0, size);
    FILE *file = fopen(path_of(name), "r");
    if (!file) return;
    size_t length = fread(text, 1, size - 1, file);
    text[length] = 0;
    fclose(file);
}

static int conducts(const char *how) {
    char text[16];
    load("conduct", text, sizeof text);
    return strcmp(text, how) == 0;
}

/* Sets output lines. The file is replaced as a whole. */
static void set_outputs(const struct gpio_v2_line_request *request, __u64 mask, __u64 bits) {
    char text[LINES + 1], new_path[4096];
    load("outputs", text, sizeof text);
    for (size_t line = 0; line < LINES; line++)
        if (!text[line]) text[line] = '-';
    for (__u32 index = 0; index < request->num_lines; index++)
        if (mask >> index & 1) text[request->offsets[index]] = bits >> index & 1 ? '1' : '0';
    snprintf(new_path, sizeof new_path, "%s", path_of("outputs.new"));
    FILE *file = fopen(new_path, "w");
    if (!file) return;
    fwrite(text, 1, LINES, file);
    fclose(file);
    rename(new_path, path_of("outputs"));
}

static int refuse(int reason) {
    errno = reason;
    return -1;
}

static int get_lines(struct gpio_v2_line_request *request) {
    if (conducts("busy")) return refuse(EBUSY);
    for (__u32 index = 0; index < request->num_lines; index++)
        if (request->offsets[index] >= LINES) return refuse(EINVAL);
    FILE *file = fopen(path_of("flags"), "a");
    for (__u32 index = 0; index < request->num_lines; index++) {
        __u64 flags = request->config.flags;
        for (__u32 at = request->config.num_attrs; at-- > 0;) {
            const struct gpio_v2_line_config_attribute *attribute = &request->config.attrs[at];
            if (attribute->attr.id == GPIO_V2_LINE_ATTR_ID_FLAGS && attribute->mask >> index & 1)
                flags = attribute->attr.flags;
        }
        if (file) fprintf(file, "%u %llu\n", request->offsets[index], (unsigned long long)flags);
    }
    if (file) fclose(file);
    for (__u32 at = 0; at < request->config.num_attrs; at++) {
        const struct gpio_v2_line_config_attribute *attribute = &request->config.attrs[at];
        if (attribute->attr.id == GPIO_V2_LINE_ATTR_ID_OUTPUT_VALUES)
            set_outputs(request, attribute->mask, attribute->attr.values);
    }
    request->fd = open("/dev/null", O_RDWR | O_CLOEXEC);
    if (request->fd < 0 || request->fd >= FILES) return refuse(EMFILE);
    requests[request->fd] = *request;
    return 0;
}

static int exchange(int file, int is_write, struct gpio_v2_line_values *values) {
    if (file < 0 || file >= FILES || !requests[file].num_lines) return refuse(EBADF);
    while (conducts("hangs")) usleep(10000);
    if (conducts("gone")) return refuse(ENODEV);
    const struct gpio_v2_line_request *request = &requests[file];
    if (is_write) {
        set_outputs(request, values->mask, values->bits);
        return 0;
    }
    char text[LINES + 1];
    load("inputs", text, sizeof text);
    values->bits = 0;
    for (__u32 index = 0; index < request->num_lines; index++)
        if (values->mask >> index & 1 && text[request->offsets[index]] == '1') values->bits |= 1ull << index;
    return 0;
}

int ioctl(int file, unsigned long call, ...) {
    va_list list;
    va_start(list, call);
    void *argument = va_arg(list, void *);
    va_end(list);
    switch (call) {
    case GPIO_V2_GET_LINE_IOCTL: return get_lines(argument);
    case GPIO_V2_LINE_GET_VALUES_IOCTL: return exchange(file, 0, argument);
    case GPIO_V2_LINE_SET_VALUES_IOCTL: return exchange(file, 1, argument);
    }
    int (*real)(int, unsigned long, ...) = dlsym(RTLD_NEXT, "ioctl");
    return real(file, call, argument);
}

char *realpath(const char *path, char *resolved) {
    if (strcmp(path, CHIP) == 0) {
        if (conducts("gone")) {
            errno = ENOENT;
            return NULL;
        }
        return resolved ? strcpy(resolved, CHIP) : strdup(CHIP);
    }
    char *(*real)(const char *, char *) = dlsym(RTLD_NEXT, "realpath");
    return real(path, resolved);
}

int open64(const char *path, int flags, ...) {
    va_list list;
    va_start(list, flags);
    mode_t mode = va_arg(list, mode_t);
    va_end(list);
    int (*real)(const char *, int, ...) = dlsym(RTLD_NEXT, "open64");
    return real(strcmp(path, CHIP) == 0 ? "/dev/null" : path, flags, mode);
}
