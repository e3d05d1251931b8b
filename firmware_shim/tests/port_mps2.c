/* Arm's MPS2 board with a Cortex-M4 (AN386), as qemu has it: semihosting for text and exit, SysTick as a counter.
 *
 * Run with -icount shift=6, each instruction takes 64 ns, which is 1.6 counts of the 25 MHz SysTick. */
#include "port.h"

#define SYST_CSR (*(volatile uint32_t *)0xE000E010u)
#define SYST_RVR (*(volatile uint32_t *)0xE000E014u)
#define SYST_CVR (*(volatile uint32_t *)0xE000E018u)
#define PAINT 0xA5A5A5A5u
#define PAINTED_WORDS 1024u

extern uint32_t stack_top[];
int main(void);

static uint32_t semihost(uint32_t operation, const void *argument)
{
    register uint32_t r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

void port_say(const char *text)
{
    (void)semihost(0x04, text);
}

uint32_t port_instructions(void)
{
    return (0xFFFFFFu - SYST_CVR) * 5 / 8;
}

/* 20000 known instructions count as 20000, to within the two readings. */
int port_counter_is_right(void)
{
    uint32_t rounds = 10000;
    const uint32_t before = port_instructions();
    uint32_t counted;
    __asm__ volatile("1: subs %0, #1\n bne 1b" : "+l"(rounds) : : "cc");
    counted = port_instructions() - before;
    return counted >= 20000 && counted < 20040;
}

/* The first painted word, a little below the caller's frame; the painting goes down from there. */
static uint32_t *below_stack(void)
{
    uint32_t here;
    __asm__ volatile("mov %0, sp" : "=r"(here));
    return (uint32_t *)(here - 64);
}

void __attribute__((noinline)) port_stack_paint(void)
{
    uint32_t *word = below_stack();
    uint32_t i;
    for (i = 0; i < PAINTED_WORDS; i++) {
        *word-- = PAINT;
    }
}

uint32_t __attribute__((noinline)) port_stack_used(void)
{
    const uint32_t *word = below_stack() - PAINTED_WORDS;
    uint32_t i;
    for (i = PAINTED_WORDS; i > 0 && *++word == PAINT; i--) {
    }
    return 4 * i + 64;
}

static void reset(void)
{
    uint32_t report[2];
    SYST_RVR = 0xFFFFFFu;
    SYST_CVR = 0;
    SYST_CSR = 5;
    report[0] = 0x20026; /* the application has ended */
    report[1] = (uint32_t)main();
    (void)semihost(0x20, report);
    for (;;) {
    }
}

static void fault(void)
{
    static const uint32_t report[2] = {0x20023, 1};
    port_say("fault\n");
    (void)semihost(0x20, report);
    for (;;) {
    }
}

__attribute__((section(".vectors"), used)) static void (*const vectors[16])(void) = {
    (void (*)(void))stack_top, reset, fault, fault, fault, fault, fault, 0, 0, 0, 0, fault, fault, 0, fault, fault,
};
