/* A Windows program that calls the functions of DLLs for a process outside Wine.
 *
 * A request comes on standard input, its answer goes to standard output. Both are a struct message and the
 * `size` bytes that follow it: `relocations` numbers of 32 bits, then whatever the arguments point to. Each
 * of those numbers says where in the message, counted in bytes from its beginning, a pointer belongs; the
 * 64-bit number there counts in the same way and becomes an address before the call. So what a function
 * writes through its arguments is in the answer. Functions are given by address: the first message, sent
 * unasked, has as arguments the addresses of those that the others are found with, and of the callbacks that
 * FMI wants. A message with function 0 tells of a crash, its result being the code of the exception.
 *
 * Lines that the FMU logs or prints go to standard error.
 */
#define WIN32_LEAN_AND_MEAN
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <windows.h>

#define ARGUMENTS 14 /* the longest function of FMI has 12 */

int __stdio_common_vsprintf(uint64_t options, char *out, size_t size, const char *format, void *locale, va_list items);
void *malloc(size_t size);
void *calloc(size_t n, size_t size);
void free(void *memory);
int _dup2(int from, int to);

struct message {
    uint64_t function, result;
    uint32_t size, relocations;
    uint64_t arguments[ARGUMENTS];
};

/* As for a function with a variable list, the first four arguments go into the registers of integers as well
 * as into those of doubles, so that they are right for either; the others lie on the stack, 8 bytes each. */
typedef uint64_t (*any_function)(double, double, double, double, ...);

static HANDLE requests, answers, lines;

static BOOL receive(void *to, uint32_t size)
{
    for (DWORD got; size; size -= got, to = (char *)to + got)
        if (!ReadFile(requests, to, size, &got, NULL) || got == 0)
            return FALSE;
    return TRUE;
}

static void send(HANDLE where, const void *data, uint32_t size)
{
    for (DWORD done; size; size -= done, data = (const char *)data + done)
        if (!WriteFile(where, data, size, &done, NULL))
            ExitProcess(1);
}

/* ---- callbacks ---- */

static void write_line(int status, const char *format, va_list items)
{
    static const char *const names[] = {"[OK] ", "[Warning] ", "[Discard] ", "[Error] ", "[Fatal] ", "[Pending] "};
    char text[2048];
    int begin = 0;
    for (const char *name = names[status >= 0 && status < 6 ? status : 0]; *name; name++)
        text[begin++] = *name;
    /* 2: as the C standard says */
    int length = __stdio_common_vsprintf(2, text + begin, sizeof text - begin - 1, format, NULL, items);
    int end = length < 0 ? begin : begin + length;
    if (end > (int)sizeof text - 2)
        end = (int)sizeof text - 2;
    text[end++] = '\n';
    send(lines, text, (uint32_t)end);
}

static void log_text(int status, const char *format, ...)
{
    va_list items;
    va_start(items, format);
    write_line(status, format, items);
    va_end(items);
}

static void log2(void *environment, const char *instance, int status, const char *category, const char *message, ...)
{
    (void)environment, (void)instance, (void)category;
    va_list items;
    va_start(items, message);
    write_line(status, message ? message : "", items);
    va_end(items);
}

static void log3(void *environment, int status, const char *category, const char *message)
{
    (void)environment, (void)category;
    log_text(status, "%s", message ? message : "");
}

/* fmi2CallbackFunctions: logger, allocateMemory, freeMemory, stepFinished, componentEnvironment. */
static void *const callbacks2[] = {(void *)log2, (void *)calloc, (void *)free, NULL, NULL};

static LONG WINAPI crashed(EXCEPTION_POINTERS *what)
{
    struct message told = {.result = what->ExceptionRecord->ExceptionCode};
    send(answers, &told, sizeof told);
    TerminateProcess(GetCurrentProcess(), 1);
    return EXCEPTION_EXECUTE_HANDLER;
}

/* ---- calls ---- */

static void place_pointers(struct message *m)
{
    const uint32_t *at = (const uint32_t *)(m + 1);
    for (uint32_t i = 0; i < m->relocations; i++)
        *(uint64_t *)((char *)m + at[i]) += (uint64_t)(uintptr_t)m;
}

static void call(struct message *m)
{
    const uint64_t *a = m->arguments;
    double d[4];
    for (int i = 0; i < 4; i++)
        d[i] = ((const double *)a)[i];
    place_pointers(m);
    for (int i = 0; i < 4; i++)
        d[i] = ((const double *)a)[i];
    any_function f = (any_function)(uintptr_t)m->function;
    m->result = f(d[0], d[1], d[2], d[3], a[4], a[5], a[6], a[7], a[8], a[9], a[10], a[11], a[12], a[13]);
}

/* What the FMU prints must not get among the answers: its standard output is the standard error. */
static void keep_answers_apart(void)
{
    HANDLE self = GetCurrentProcess();
    requests = GetStdHandle(STD_INPUT_HANDLE);
    lines = GetStdHandle(STD_ERROR_HANDLE);
    DuplicateHandle(self, GetStdHandle(STD_OUTPUT_HANDLE), self, &answers, 0, FALSE, DUPLICATE_SAME_ACCESS);
    SetStdHandle(STD_OUTPUT_HANDLE, lines);
    _dup2(2, 1);
}

static void introduce(void)
{
    struct message hello = {.function = 1};
    hello.arguments[0] = (uint64_t)(uintptr_t)LoadLibraryExA;
    hello.arguments[1] = (uint64_t)(uintptr_t)GetProcAddress;
    hello.arguments[2] = (uint64_t)(uintptr_t)GetLastError;
    hello.arguments[3] = (uint64_t)(uintptr_t)callbacks2;
    hello.arguments[4] = (uint64_t)(uintptr_t)log3;
    send(answers, &hello, sizeof hello);
}

void mainCRTStartup(void)
{
    static struct message first;
    struct message *m = &first;
    uint32_t room = 0;
    keep_answers_apart();
    SetErrorMode(SEM_FAILCRITICALERRORS | SEM_NOGPFAULTERRORBOX | SEM_NOOPENFILEERRORBOX);
    SetUnhandledExceptionFilter(crashed);
    introduce();
    for (struct message head; receive(&head, sizeof head);) {
        if (head.size > room || m == &first) {
            if (m != &first)
                free(m);
            room = head.size;
            m = malloc(sizeof *m + room);
            if (!m)
                ExitProcess(1);
        }
        *m = head;
        if (!receive(m + 1, m->size))
            break;
        call(m);
        send(answers, m, (uint32_t)(sizeof *m) + m->size);
    }
    ExitProcess(0);
}
