/* The plain rule with other cells: several predictions deep, or refreshed by their hits. One horizon, opposite polarity.
 *
 * A cell has `depth` slots (time due, polarity). A prediction takes the first slot that is not open, else the one due
 * first. An event takes the nearest pixel with an open slot of its polarity, there the slot due first. A slot bears
 * `uses` hits, and a prediction for a polarity that is open at depth 1 adds one, up to `uses`; 0 bears any number.
 * With `refresh` a hit moves the slot's time to the event's, and takes no use. */
#include <stdint.h>
#include <string.h>

void bursts(int64_t n, int64_t width, int64_t height, int64_t horizon, int64_t gate, int64_t depth, int64_t uses,
            int64_t refresh, int64_t window, const int64_t *offsets, const int64_t *t, const int32_t *x, const int32_t *y,
            const uint8_t *p, const int32_t *to_x, const int32_t *to_y, int64_t *due, uint8_t *sign, uint8_t *left,
            uint8_t *suppressed) {
    int64_t passed = 0;
    for (int64_t i = 0; i < n; i++) {
        while (passed < i && t[passed] + horizon - gate <= t[i]) {
            int64_t e = passed++, when = t[e] + horizon;
            if (to_x[e] < 0 || to_x[e] >= width || to_y[e] < 0 || to_y[e] >= height || when + gate < t[i]) continue;
            int64_t base = (to_y[e] * width + to_x[e]) * depth, take = -1, oldest = base;
            if (depth == 1 && uses != 1 && left[base] && due[base] + gate >= t[i] && sign[base] == p[e]) {
                if (uses && left[base] < uses) left[base]++;
                due[base] = when;
                continue;
            }
            for (int64_t s = base; s < base + depth; s++) {
                if (take < 0 && (!left[s] || due[s] + gate < t[i])) take = s;
                if (due[s] < due[oldest]) oldest = s;
            }
            if (take < 0) take = oldest;
            due[take] = when, sign[take] = p[e], left[take] = 1;
        }
        int64_t hit = -1;
        for (int64_t o = 0; o < window && hit < 0; o++) {
            int64_t column = x[i] + offsets[2 * o], row = y[i] + offsets[2 * o + 1];
            if (column < 0 || column >= width || row < 0 || row >= height) continue;
            int64_t base = (row * width + column) * depth;
            for (int64_t s = base; s < base + depth; s++)
                if (left[s] && sign[s] == p[i] && due[s] - gate <= t[i] && t[i] <= due[s] + gate &&
                    (hit < 0 || due[s] < due[hit]))
                    hit = s;
        }
        suppressed[i] = hit >= 0;
        if (hit >= 0 && refresh)
            due[hit] = t[i];
        else if (hit >= 0 && uses)
            left[hit]--;
    }
}
