/* Drives the FMI 3 binary beside it through the steps in input.bin and writes output.bin.
 *
 * Only what Windows itself exports is used there, so that the driver needs no C runtime of its own. */
#include <stddef.h>
#include <stdint.h>

typedef struct FILE FILE;
FILE *fopen(const char *, const char *);
size_t fread(void *, size_t, size_t, FILE *);
size_t fwrite(const void *, size_t, size_t, FILE *);
int fclose(FILE *);

typedef void *instance;
typedef instance (*instantiate)(const char *, const char *, const char *, _Bool, _Bool, _Bool, _Bool,
                                const uint32_t *, size_t, void *, void *, void *);
typedef int (*enter)(instance, _Bool, double, double, _Bool, double);
typedef int (*plain)(instance);
typedef int (*get_or_set)(instance, const uint32_t *, size_t, double *, size_t);
typedef int (*do_step)(instance, double, double, _Bool, _Bool *, _Bool *, _Bool *, double *);

static struct {
    char token[64];
    uint32_t inputs, outputs, input_values, output_values, steps, unused;
    double h;
    uint32_t references[256];
} head;
static double values[1024];

#ifdef _WIN32
void *LoadLibraryA(const char *);
void *GetProcAddress(void *, const char *);
void ExitProcess(unsigned);
#define LIBRARY "model.dll"
#define open_library LoadLibraryA
#define symbol GetProcAddress
#else
#include <dlfcn.h>
#define LIBRARY "./model.so"
#define open_library(name) dlopen(name, RTLD_NOW)
#define symbol dlsym
#endif

#define FUNCTION(type, name) type name = (type)(size_t)symbol(library, "fmi3" #name)

static int drive(void) {
    void *library = open_library(LIBRARY);
    if (!library) return 2;
    FUNCTION(instantiate, InstantiateCoSimulation);
    FUNCTION(enter, EnterInitializationMode);
    FUNCTION(plain, ExitInitializationMode);
    FUNCTION(get_or_set, SetFloat64);
    FUNCTION(get_or_set, GetFloat64);
    FUNCTION(do_step, DoStep);
    FUNCTION(plain, Terminate);
    FILE *in = fopen("input.bin", "rb"), *out = fopen("output.bin", "wb");
    if (!in || !out || fread(&head, sizeof head, 1, in) != 1) return 3;
    instance model = InstantiateCoSimulation("model", head.token, NULL, 0, 0, 0, 0, NULL, 0, NULL, NULL, NULL);
    if (!model) return 4;
    if (EnterInitializationMode(model, 0, 0.0, 0.0, 0, 0.0) || ExitInitializationMode(model)) return 5;
    for (uint32_t k = 0; k < head.steps; ++k) {
        _Bool event, terminate, early;
        double last;
        if (fread(values, sizeof *values, head.input_values, in) != head.input_values) return 6;
        if (SetFloat64(model, head.references, head.inputs, values, head.input_values)) return 7;
        if (DoStep(model, k * head.h, head.h, 1, &event, &terminate, &early, &last)) return 8;
        if (GetFloat64(model, head.references + head.inputs, head.outputs, values, head.output_values)) return 9;
        fwrite(values, sizeof *values, head.output_values, out);
    }
    if (Terminate(model)) return 10;
    fclose(out);
    return 0;
}

#ifdef _WIN32
void mainCRTStartup(void) { ExitProcess((unsigned)drive()); }
#else
int main(void) { return drive(); }
#endif
