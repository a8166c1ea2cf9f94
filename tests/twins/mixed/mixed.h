/* A counter with variables of many types; written against the FMI headers alone, so that the twin meets an FMU that our
 * adapter did not make. */
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    int count, offset, gain;
    bool inverted, enable, dead;
    void *environment;
    void (*logger)(void);
} Mixed;

static void forget(Mixed *m) {
    if (m->dead) abort();
    m->count = m->offset = 0;
    m->gain = 1;
    m->inverted = false;
    m->enable = true;
}

static void start(Mixed *m) { m->count = m->offset; }
static void advance(Mixed *m) { m->count += m->enable ? m->gain : 0; }
static double force(const Mixed *m) { return m->count / 4.0; }
static bool closed(const Mixed *m) { return (m->count > 2) != m->inverted; }
static int level(const Mixed *m) { return m->count < 3 ? 1 : 2; }
