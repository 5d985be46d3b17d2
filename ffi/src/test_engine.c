/*
 * The part of an engine that only C can play in tests: a variadic print and an error function that leaves by longjmp
 * from under the renderer's frames, as the real engine's does.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

static jmp_buf main_loop;
static char message[8192];
static int level;
static char printed[65536];
static void (*inside_error)(void);

void test_printf(int print_level, const char *format, ...)
{
	size_t used = strlen(printed);
	va_list arguments;
	(void)print_level;
	va_start(arguments, format);
	vsnprintf(printed + used, sizeof(printed) - used, format, arguments);
	va_end(arguments);
}

void test_error(int error_level, const char *format, ...)
{
	va_list arguments;
	va_start(arguments, format);
	vsnprintf(message, sizeof(message), format, arguments);
	va_end(arguments);
	level = error_level;
	/* The engine shuts down and registers again before it jumps. */
	if (inside_error) {
		inside_error();
	}
	longjmp(main_loop, 1);
}

/* Runs one call of the "engine's main loop". Answers whether it ended in an error. */
int test_run(void (*call)(void))
{
	message[0] = 0;
	if (setjmp(main_loop)) {
		return 1;
	}
	call();
	return 0;
}

void test_set_inside_error(void (*function)(void))
{
	inside_error = function;
}

const char *test_message(void) { return message; }
int test_level(void) { return level; }
const char *test_printed(void) { return printed; }
void test_clear_printed(void) { printed[0] = 0; }
