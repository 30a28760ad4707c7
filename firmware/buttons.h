/* Two buttons, from D4 and D9 to ground. */
#ifndef BUTTONS_H
#define BUTTONS_H

#include <stdint.h>

#define BUTTONS_THERE 0x03

void buttons_init(void);

/* Called once a sample: the buttons pressed, one bit each. A change counts when it has lasted three samples, as contacts bounce. */
uint8_t buttons_pressed(void);

#endif
