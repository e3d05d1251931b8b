/* What the self-test needs of the machine it runs on. */
#ifndef PORT_H
#define PORT_H

#include <stdint.h>

void port_say(const char *text);

/* Instructions since some moment, modulo 2^24 / 1.6; always 0 where they cannot be counted. */
uint32_t port_instructions(void);
int port_counter_is_right(void);

/* Fill the unused stack, and find how much of the filling is gone. Always 0 where that cannot be seen. */
void port_stack_paint(void);
uint32_t port_stack_used(void);

#endif
