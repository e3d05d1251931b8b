/* Guard and limits, each at its boundary. Every line and branch of guard.c, and what kills its mutants. */
#include "internal.h"

#include <stdio.h>

static int failures;

#define EXPECT(condition)                                         \
    do {                                                          \
        if (!(condition)) {                                       \
            printf("line %d: %s\n", __LINE__, #condition);        \
            failures++;                                           \
        }                                                         \
    } while (0)

static mtm_shim at_rest(void)
{
    static const mtm_settings settings = {50000, 1000, 100, 250, {10, 20, 30}};
    mtm_shim shim;
    uint32_t axis;
    mtm_clear(&shim, sizeof shim);
    shim.settings = settings;
    shim.age_us = UINT32_MAX;
    for (axis = 0; axis < MTM_AXES; axis++) {
        shim.limit[axis] = settings.limit[axis];
    }
    return shim;
}

static void counters_stay_at_their_largest_value(void)
{
    uint32_t counter = 0;
    mtm_count(&counter);
    EXPECT(counter == 1);
    counter = UINT32_MAX - 1;
    mtm_count(&counter);
    EXPECT(counter == UINT32_MAX);
    mtm_count(&counter);
    EXPECT(counter == UINT32_MAX);
}

static void values_are_cut_at_their_limit_and_counted(void)
{
    uint32_t clamps = 0;
    EXPECT(mtm_limited(10, 10, &clamps) == 10);
    EXPECT(mtm_limited(-10, 10, &clamps) == -10);
    EXPECT(mtm_limited(0, 0, &clamps) == 0);
    EXPECT(mtm_limited(9, 10, &clamps) == 9);
    EXPECT(clamps == 0);
    EXPECT(mtm_limited(11, 10, &clamps) == 10);
    EXPECT(clamps == 1);
    EXPECT(mtm_limited(-11, 10, &clamps) == -10);
    EXPECT(clamps == 2);
    EXPECT(mtm_limited(INT32_MIN, MTM_Q20_MAX, &clamps) == -MTM_Q20_MAX);
    EXPECT(mtm_limited(INT32_MAX, MTM_Q20_MAX, &clamps) == MTM_Q20_MAX);
    EXPECT(clamps == 4);
}

static void fading_scales_and_never_grows(void)
{
    EXPECT(mtm_faded(1000, 256) == 1000);
    EXPECT(mtm_faded(-1000, 128) == -500);
    EXPECT(mtm_faded(1000, 0) == 0);
    EXPECT(mtm_faded(MTM_Q20_MAX, 255) == (mtm_q20)((int64_t)MTM_Q20_MAX * 255 / 256));
    EXPECT(mtm_faded(-1, 255) == 0);
}

static uint8_t good_with(uint32_t rate_mhz, uint32_t hold_ms, uint32_t zero_ms, uint32_t axis, mtm_q20 limit)
{
    mtm_settings settings = {0, 0, 0, 0, {1, 1, 1}};
    settings.rate_mhz = rate_mhz;
    settings.hold_ms = hold_ms;
    settings.zero_ms = zero_ms;
    settings.limit[axis] = limit;
    return mtm_settings_good(&settings);
}

static void settings_outside_their_range_are_refused(void)
{
    uint32_t axis;
    EXPECT(good_with(1000, 1, 2, 0, 1) == 1);
    EXPECT(good_with(1000000, 9999, 10000, 0, 1) == 1);
    EXPECT(good_with(999, 1, 2, 0, 1) == 0);
    EXPECT(good_with(1000001, 1, 2, 0, 1) == 0);
    EXPECT(good_with(50000, 0, 2, 0, 1) == 0);
    EXPECT(good_with(50000, 2, 2, 0, 1) == 0);
    EXPECT(good_with(50000, 3, 2, 0, 1) == 0);
    EXPECT(good_with(50000, 9999, 10001, 0, 1) == 0);
    for (axis = 0; axis < MTM_AXES; axis++) {
        EXPECT(good_with(50000, 1, 2, axis, 0) == 1);
        EXPECT(good_with(50000, 1, 2, axis, MTM_Q20_MAX) == 1);
        EXPECT(good_with(50000, 1, 2, axis, -1) == 0);
        EXPECT(good_with(50000, 1, 2, axis, MTM_Q20_MAX + 1) == 0);
    }
}

static void age_grows_and_stays_at_its_largest_value(void)
{
    mtm_shim shim = at_rest();
    mtm_guard_age(&shim, 5);
    EXPECT(shim.age_us == UINT32_MAX);
    EXPECT(shim.counts.deadman_trips == 0);
    shim.age_us = 10;
    mtm_guard_age(&shim, 5);
    EXPECT(shim.age_us == 15);
    shim.age_us = UINT32_MAX - 5;
    mtm_guard_age(&shim, 4);
    EXPECT(shim.age_us == UINT32_MAX - 1);
    mtm_guard_age(&shim, 1);
    EXPECT(shim.age_us == UINT32_MAX);
    mtm_guard_age(&shim, 0);
    EXPECT(shim.age_us == UINT32_MAX);
}

static void the_deadman_trips_once_each_time(void)
{
    mtm_shim shim = at_rest();
    shim.age_us = 0;
    mtm_guard_age(&shim, 99999);
    EXPECT(shim.counts.deadman_trips == 0);
    mtm_guard_age(&shim, 1);
    EXPECT(shim.counts.deadman_trips == 1);
    mtm_guard_age(&shim, 1);
    mtm_guard_age(&shim, 1000000);
    EXPECT(shim.counts.deadman_trips == 1);
    shim.age_us = 99999;
    mtm_guard_age(&shim, 500000);
    EXPECT(shim.counts.deadman_trips == 2);
}

static void a_good_command_is_limited_and_young(void)
{
    static const mtm_velocity fast = {{11, -21, 30}};
    mtm_shim shim = at_rest();
    mtm_guard_accept(&shim, &fast);
    EXPECT(shim.age_us == 0);
    EXPECT(shim.base.axis[0] == 10 && shim.base.axis[1] == -20 && shim.base.axis[2] == 30);
    EXPECT(shim.counts.base_clamps == 2);
    EXPECT(shim.counts.refused_commands == 0);
}

static void a_command_that_is_not_a_number_changes_nothing(void)
{
    uint32_t axis;
    for (axis = 0; axis < MTM_AXES; axis++) {
        mtm_velocity bad = {{1, 2, 3}};
        mtm_shim shim = at_rest();
        bad.axis[axis] = MTM_Q20_INVALID;
        mtm_guard_accept(&shim, &bad);
        EXPECT(shim.age_us == UINT32_MAX);
        EXPECT(shim.base.axis[0] == 0 && shim.base.axis[1] == 0 && shim.base.axis[2] == 0);
        EXPECT(shim.counts.refused_commands == 1);
    }
}

static void expect_gain(uint32_t age_us, uint32_t gain, uint8_t fresh)
{
    mtm_shim shim = at_rest();
    shim.age_us = age_us;
    EXPECT(mtm_guard_gain(&shim) == gain);
    EXPECT(mtm_guard_fresh(&shim) == fresh);
    shim.stopped = 1;
    EXPECT(mtm_guard_gain(&shim) == 0);
    EXPECT(mtm_guard_fresh(&shim) == 0);
}

static void the_gain_falls_from_hold_to_zero(void)
{
    mtm_shim shim = at_rest();
    expect_gain(0, 256, 1);
    expect_gain(99999, 256, 1);
    expect_gain(100000, 256, 0);
    expect_gain(100001, 255, 0);
    expect_gain(175000, 128, 0);
    expect_gain(249999, 0, 0);
    expect_gain(249414, 1, 0);
    expect_gain(249415, 0, 0);
    expect_gain(250000, 0, 0);
    expect_gain(UINT32_MAX, 0, 0);
    shim.settings.hold_ms = 1;
    shim.settings.zero_ms = 10000;
    shim.age_us = 1000;
    EXPECT(mtm_guard_gain(&shim) == 256);
}

static void stop_holds_until_released_and_forgets_the_command(void)
{
    mtm_shim shim = at_rest();
    shim.age_us = 7;
    mtm_shim_release(&shim);
    EXPECT(shim.stopped == 0 && shim.age_us == 7);
    mtm_shim_stop(&shim);
    EXPECT(shim.stopped == 1 && shim.age_us == 7);
    mtm_shim_release(&shim);
    EXPECT(shim.stopped == 0 && shim.age_us == UINT32_MAX);
}

int main(void)
{
    counters_stay_at_their_largest_value();
    values_are_cut_at_their_limit_and_counted();
    fading_scales_and_never_grows();
    settings_outside_their_range_are_refused();
    age_grows_and_stays_at_its_largest_value();
    the_deadman_trips_once_each_time();
    a_good_command_is_limited_and_young();
    a_command_that_is_not_a_number_changes_nothing();
    the_gain_falls_from_hold_to_zero();
    stop_holds_until_released_and_forgets_the_command();
    return failures != 0;
}
