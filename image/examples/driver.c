/* Opens and closes the door of a control, its input DOOR, twice a second, and prints its output PUMP when it changes.
 * cc -I image/include -o driver image/examples/driver.c; ./driver IMAGE ROUNDS */
#include "plcc_image.h"

int main(int count, char **words) {
    struct plcc_image image;
    if (count != 3 || plcc_image_open(&image, words[1], 1)) return 1;
    const struct plcc_symbol *door = plcc_image_find(&image, "DOOR");
    const struct plcc_symbol *pump = plcc_image_find(&image, "PUMP");
    if (!door || !pump || plcc_inputs_begin(&image, "driver in C") || plcc_inputs_claim(&image, door)) return 2;
    double before = -1;
    for (int round = 0; round < atoi(words[2]); round++) {
        plcc_inputs_set(&image, door, round / 50 % 2); /* in every round, so that it is never late */
        if (plcc_inputs_publish(&image)) return 3;     /* the mailbox belongs to another process */
        usleep(10000);
        if (plcc_image_read(&image)) return 4;         /* the control has died while it wrote a tick */
        double now = plcc_image_value(&image, pump);
        if (now != before) printf("PUMP %g\n", before = now);
        if (image.state >= 3) return 5;                /* it has ended, or another file has this name now */
    }
    plcc_image_close(&image);                          /* the input takes its safe value */
    return 0;
}
