/* The part of the stand-in engine that has to be C: variadic messages, and errors that leave the renderer by
   longjmp, over whatever frames lie between, exactly as the real engine's do. On Windows longjmp unwinds these
   frames. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

/* The engine formats into buffers of this size. */
#define MAX_MESSAGE 4096

/* In Rust: what to do with a message, and with an error before the jump. */
void stand_in_print(int level, const char *text);
void stand_in_error(int level, const char *text);

struct frame {
    jmp_buf place;
    int level;
    struct frame *outer;
};

/* Calls into the renderer nest: an error handler calls it again. One thread at a time is the engine. */
static _Thread_local struct frame *innermost;

/* Calls thunk(argument). Returns -1 when it came back by itself, else the level of the error that ended it. */
int stand_in_call(void (*thunk)(void *), void *argument) {
    struct frame here;
    here.outer = innermost;
    innermost = &here;
    if (setjmp(here.place) == 0) {
        thunk(argument);
        innermost = here.outer;
        return -1;
    }
    innermost = here.outer;
    return here.level;
}

void stand_in_printf(int level, const char *format, ...) {
    char text[MAX_MESSAGE];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    stand_in_print(level, text);
}

void stand_in_raise(int level, const char *format, ...) {
    char text[MAX_MESSAGE];
    struct frame *to = innermost;
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    if (!to) {
        fprintf(stderr, "error outside of any call: %s\n", text);
        abort();
    }
    to->level = level;
    stand_in_error(level, text);
    /* stand_in_error called the renderer again; those calls are over */
    innermost = to;
    longjmp(to->place, 1);
}
