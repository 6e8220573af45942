/* Read the framed protocol from framed.md alone, as a microcontroller would: bytes of the line on standard input, one
   event a line on standard output. Any frame that is not sound is passed over. */
#include <stdint.h>
#include <stdio.h>

static uint8_t frame[1536];
static const uint8_t *bits;
static uint32_t bit;
static int bx, by;
static uint32_t tick_ns;
static int64_t base;

static uint32_t take(int n) {
    uint32_t value = 0;
    for (int i = 0; i < n; i++, bit++)
        value |= (uint32_t)(bits[bit >> 3] >> (bit & 7) & 1) << i;
    return value;
}

static uint32_t flag(uint32_t at) { return bits[at >> 3] >> (at & 7) & 1; }

static uint32_t u16(const uint8_t *p) { return p[0] | p[1] << 8; }

static uint32_t u32(const uint8_t *p) { return u16(p) | u16(p + 2) << 16; }

static int32_t unzigzag(uint32_t v) { return (int32_t)(v >> 1) ^ -(int32_t)(v & 1); }

static int width_of(uint32_t side) {
    int n = 1;
    while (n < 16 && (side - 1) >> n)
        n++;
    return n;
}

static uint16_t crc(const uint8_t *p, int n) {
    uint16_t c = 0xFFFF;
    while (n--) {
        c ^= (uint16_t)(*p++ << 8);
        for (int i = 0; i < 8; i++)
            c = (uint16_t)(c & 0x8000 ? c << 1 ^ 0x1021 : c << 1);
    }
    return c;
}

static int cobs(uint8_t *p, int n) {
    int from = 0, to = 0;
    while (from < n) {
        int code = p[from++];
        for (int i = 1; i < code && from < n; i++)
            p[to++] = p[from++];
        if (code < 255 && from < n)
            p[to++] = 0;
    }
    return to;
}

static void events(const uint8_t *p) {
    uint32_t n = p[6], form = u16(p + 7), x = 0, y = 0;
    int wt = form & 31, wx = form >> 6 & 15, wy = form >> 11 & 15;
    uint32_t mt = form >> 5 & 1, mx = form >> 10 & 1, my = form >> 15 & 1;
    int64_t t = base + (uint32_t)(u32(p + 2) - (uint32_t)base);
    bits = p + 9;
    bit = (mt + mx + my) * n;
    base = t;
    for (uint32_t i = 0; i < n; i++) {
        uint32_t on = take(1);
        x = wx == 15 || (mx && flag(mt * n + i)) ? take(bx) : x + (uint32_t)unzigzag(take(wx));
        y = wy == 15 || (my && flag((mt + mx) * n + i)) ? take(by) : y + (uint32_t)unzigzag(take(wy));
        t += take(mt && flag(i) ? 20 : wt);
        printf("%lld %u %u %u\n", (long long)(t * tick_ns / 1000), x, y, on);
    }
}

int main(void) {
    int n = 0;
    for (int byte; (byte = getchar()) != EOF;) {
        if (byte) {
            if (n < (int)sizeof frame)
                frame[n++] = (uint8_t)byte;
            continue;
        }
        n = cobs(frame, n);
        if (n >= 4 && crc(frame, n) == 0 && frame[0] >> 4 == 1) {
            const uint8_t *p = frame + 2;
            if ((frame[0] & 15) == 0) {
                bx = width_of(u16(p + 2));
                by = width_of(u16(p + 4));
                tick_ns = u16(p + 6);
                base = (int64_t)((uint64_t)u32(p + 16) << 32 | u32(p + 12));
            } else if ((frame[0] & 15) == 1 && tick_ns)
                events(p);
        }
        n = 0;
    }
    return 0;
}
