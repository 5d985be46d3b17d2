/*
 * A renderer library for tests of the substitute: it counts how often it was shut down, in a file that its import
 * table's first entry, here a plain string, names.
 */
#include <stdio.h>
#include <string.h>

static const char *report;
static void *exports[30];

static void shutdown_renderer(int destroy)
{
	FILE *file = fopen(report, "a");
	if (file) {
		fprintf(file, "%d\n", destroy);
		fclose(file);
	}
}

void *GetRefAPI(int version, void **imports)
{
	if (version != 8) {
		return NULL;
	}
	report = (const char *)imports[0];
	exports[0] = (void *)shutdown_renderer;
	return exports;
}
