/* Preloaded into the engine for pictures that are to be compared: every library that calls rand() gets its
   own repeatable sequence, so that a renderer that draws more random numbers than another does not change
   which particles the game throws. srand() does nothing. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdlib.h>

struct sequence {
    const void *library;
    unsigned long long state;
    struct sequence *next;
};

static struct sequence *sequences;

static struct sequence *sequence_of(const void *library) {
    struct sequence *s;
    for (s = sequences; s; s = s->next) {
        if (s->library == library) return s;
    }
    s = malloc(sizeof *s);
    if (!s) abort();
    s->library = library;
    s->state = 0x2545F4914F6CDD1Dull;
    s->next = sequences;
    sequences = s;
    return s;
}

int rand(void) {
    Dl_info caller;
    struct sequence *s;
    const void *library = NULL;
    if (dladdr(__builtin_return_address(0), &caller)) library = caller.dli_fbase;
    s = sequence_of(library);
    /* xorshift64 (Marsaglia 2003) */
    s->state ^= s->state << 13;
    s->state ^= s->state >> 7;
    s->state ^= s->state << 17;
    return (int)(s->state >> 33);
}

void srand(unsigned seed) { (void)seed; }
