/* Seeded random streams: xoshiro256** (Blackman, Vigna 2018) seeded by splitmix64, normal deviates by Box and Muller. */
#ifndef RANDOM_H
#define RANDOM_H

#include <math.h>
#include <stdint.h>

typedef struct {
    uint64_t s[4];
    double spare;
    int has_spare;
} Stream;

static inline uint64_t splitmix64(uint64_t *x) {
    uint64_t z = (*x += 0x9E3779B97F4A7C15u);
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
}

/* One of several independent streams of one seed. */
static inline void stream_seed(Stream *r, uint64_t seed, uint64_t which) {
    uint64_t x = seed;
    x = splitmix64(&x) ^ (which * 0xD1342543DE82EF95u);
    for (int i = 0; i < 4; i++) r->s[i] = splitmix64(&x);
    r->has_spare = 0;
    r->spare = 0.0;
}

static inline uint64_t rotl64(uint64_t x, int k) { return (x << k) | (x >> (64 - k)); }

static inline uint64_t stream_next(Stream *r) {
    uint64_t *s = r->s, out = rotl64(s[1] * 5, 7) * 9, t = s[1] << 17;
    s[2] ^= s[0];
    s[3] ^= s[1];
    s[1] ^= s[2];
    s[0] ^= s[3];
    s[2] ^= t;
    s[3] = rotl64(s[3], 45);
    return out;
}

/* A standard normal deviate. */
static inline double stream_normal(Stream *r) {
    if (r->has_spare) {
        r->has_spare = 0;
        return r->spare;
    }
    double u = ((double)(stream_next(r) >> 11) + 1.0) * 0x1p-53, v = (double)(stream_next(r) >> 11) * 0x1p-53;
    double radius = sqrt(-2.0 * log(u)), angle = 6.283185307179586 * v;
    r->spare = radius * sin(angle);
    r->has_spare = 1;
    return radius * cos(angle);
}

#endif
