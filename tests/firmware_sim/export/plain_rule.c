/* Decide the vectors by the plain rule, from the headers alone, and print the sums of every array. */
#include <stdio.h>
#include "tiegocancel_config.h"
#include "tiegocancel_vectors.h"
#include "tiegocancel_vectors.h" /* guarded */

#define CELLS (TIEGOCANCEL_WIDTH * TIEGOCANCEL_HEIGHT)
#define LENGTH(array) (sizeof(array) / sizeof((array)[0]))

struct prediction {
    int64_t due;
    int64_t x;
    int64_t y;
    int p;
    int valid;
};

static struct prediction ring[LENGTH(tiegocancel_event_x)];
static struct prediction table[CELLS];

static int64_t along(int64_t own, const int32_t *abc, int64_t x, int64_t y)
{
    int64_t sum = own * 65536 + (int64_t)abc[0] * x + (int64_t)abc[1] * y + (int64_t)abc[2] + 32768;
    return (sum >= 0) ? (sum / 65536) : -((-sum + 65535) / 65536);
}

static int suppresses(int64_t t, int64_t x, int64_t y, int p)
{
    for (size_t o = 0; o < TIEGOCANCEL_WINDOW; o++) {
        int64_t column = x + tiegocancel_window_dx[o];
        int64_t row = y + tiegocancel_window_dy[o];
        if ((column < 0) || (row < 0) || (column >= (int64_t)TIEGOCANCEL_WIDTH) ||
            (row >= (int64_t)TIEGOCANCEL_HEIGHT)) {
            continue;
        }
        struct prediction *cell = &table[row * (int64_t)TIEGOCANCEL_WIDTH + column];
        int meets = (TIEGOCANCEL_POLARITY_ANY != 0U) || ((cell->p != p) == (TIEGOCANCEL_POLARITY_FLIP != 0U));
        if ((cell->valid != 0) && meets && (t <= cell->due + tiegocancel_late_ticks[1])) {
            cell->valid = 0;
            return 1;
        }
    }
    return 0;
}

int main(void)
{
    size_t head = 0;
    size_t tail = 0;
    size_t entry = 0;
    unsigned wrong = 0;
    unsigned suppressed = 0;
    int64_t sums[5] = {0, 0, 0, 0, 0};
    for (size_t i = 0; i < TIEGOCANCEL_EVENTS; i++) {
        int64_t t = (int64_t)tiegocancel_event_t_us[i];
        int64_t x = (int64_t)tiegocancel_event_x[i];
        int64_t y = (int64_t)tiegocancel_event_y[i];
        int p = (int)tiegocancel_event_p[i];
        while ((head < tail) && (ring[head].due - (int64_t)TIEGOCANCEL_EARLY_TICKS <= t)) {
            table[ring[head].y * (int64_t)TIEGOCANCEL_WIDTH + ring[head].x] = ring[head];
            head++;
        }
        int hit = suppresses(t, x, y, p);
        wrong += (hit != (int)tiegocancel_suppressed[i]) ? 1U : 0U;
        suppressed += (unsigned)hit;
        while ((entry + 1U < TIEGOCANCEL_SCHEDULE_ENTRIES) && ((int64_t)tiegocancel_schedule_t_us[entry + 1U] <= t)) {
            entry++;
        }
        struct prediction made = {t + tiegocancel_horizon_ticks[0], 0, 0, p, 1};
        made.x = along(x, &tiegocancel_schedule[0][entry][0], x, y);
        made.y = along(y, &tiegocancel_schedule[0][entry][3], x, y);
        if ((made.x >= 0) && (made.y >= 0) && (made.x < (int64_t)TIEGOCANCEL_WIDTH) &&
            (made.y < (int64_t)TIEGOCANCEL_HEIGHT) && (tail - head < tiegocancel_ring_capacity[0])) {
            ring[tail] = made;
            tail++;
        }
        sums[0] += t;
        sums[1] += x;
        sums[2] += y;
        sums[3] += p;
        sums[4] += (int64_t)tiegocancel_support[i];
    }
    (void)printf("%u %u %lld %lld %lld %lld %lld\n", wrong, suppressed, (long long)sums[0], (long long)sums[1],
                 (long long)sums[2], (long long)sums[3], (long long)sums[4]);
    return 0;
}
