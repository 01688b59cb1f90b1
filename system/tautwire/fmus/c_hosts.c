/* The library that an importer loads as NAME.so. It sees to it that the process has a Python, then hands all calls on
   to pythonfmu's wrapper, which lies beside it as NAME.pythonfmu.so and has undefined symbols of libpython.

   A process that has a Python keeps it: nothing is loaded or started. Otherwise libpython is opened for all to see,
   as the standard library's extension modules need it, and started apart from the host: no environment variables, no
   site-packages, no signal handlers, no locale, UTF-8 paths. It stays until the process ends.

   c_hosts.py defines PYTHON_LIBRARY, PYTHON_SONAME, PYTHON_HOME and STANDARD_LIBRARY. */
#define _GNU_SOURCE 1
#include <Python.h>
#include <dlfcn.h>
#include <limits.h>
#include <link.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define PUBLIC __attribute__((visibility("default")))
#define TAKE(library, name) __typeof__(name) *take_##name = (__typeof__(name) *)dlsym(library, #name)

enum { FMI_ERROR = 3 };

typedef void *Component;
typedef void *State;
typedef unsigned int Reference;

typedef struct {
    void (*logger)(void *, const char *, int, const char *, const char *, ...);
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*finished)(void *, int);
    void *environment;
} Callbacks;

static void *wrapper;
static char own_path[PATH_MAX];
static char failure[PATH_MAX * 3];

static void fail(const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(failure, sizeof failure, format, arguments);
    va_end(arguments);
}

/* RTLD_DEFAULT would also look into what this library itself needs. */
static int program_has_python(void) {
    void *program = dlopen(NULL, RTLD_NOW);
    int found = dlsym(program, "Py_IsInitialized") != NULL;
    dlclose(program);
    return found;
}

static int is_libpython(struct dl_phdr_info *object, size_t size, void *path) {
    const char *slash = strrchr(object->dlpi_name, '/');
    (void)size;
    if (strncmp(slash ? slash + 1 : object->dlpi_name, "libpython3", strlen("libpython3")) != 0) return 0;
    snprintf(path, PATH_MAX, "%s", object->dlpi_name);
    return 1;
}

/* A plugin of the host may have loaded a Python for itself; a second one would be mixed up with it. */
static int share_private_python(void) {
    char path[PATH_MAX];
    return dl_iterate_phdr(is_libpython, path) && dlopen(path, RTLD_NOW | RTLD_NOLOAD | RTLD_GLOBAL);
}

static int start_python(void *library, const char *home) {
    TAKE(library, PyPreConfig_InitIsolatedConfig);
    TAKE(library, Py_PreInitialize);
    TAKE(library, PyConfig_InitIsolatedConfig);
    TAKE(library, PyConfig_SetBytesString);
    TAKE(library, Py_InitializeFromConfig);
    TAKE(library, PyConfig_Clear);
    TAKE(library, PyStatus_Exception);
    TAKE(library, PyEval_SaveThread);
    PyPreConfig before;
    PyConfig config;
    take_PyPreConfig_InitIsolatedConfig(&before);
    before.utf8_mode = 1;
    PyStatus status = take_Py_PreInitialize(&before);
    take_PyConfig_InitIsolatedConfig(&config);
    config.site_import = 0;
    config.write_bytecode = 0;
    config.buffered_stdio = 0; /* nothing would flush it: Python is never finalised */
    if (home != NULL && !take_PyStatus_Exception(status)) {
        status = take_PyConfig_SetBytesString(&config, &config.home, home);
        /* With a slash in it PATH is not searched for a Python. */
        if (!take_PyStatus_Exception(status))
            status = take_PyConfig_SetBytesString(&config, &config.program_name, PYTHON_PROGRAM);
    }
    if (!take_PyStatus_Exception(status)) status = take_Py_InitializeFromConfig(&config);
    take_PyConfig_Clear(&config);
    if (take_PyStatus_Exception(status)) {
        fail("Python did not start: %s", status.err_msg ? status.err_msg : "no reason given");
        return 0;
    }
    take_PyEval_SaveThread();
    return 1;
}

static int open_python(void) {
    const char *home = access(STANDARD_LIBRARY, R_OK) == 0 ? PYTHON_HOME : NULL;
    void *library = home ? dlopen(PYTHON_LIBRARY, RTLD_NOW | RTLD_GLOBAL) : NULL;
    if (library != NULL) return start_python(library, home);
    library = dlopen(PYTHON_SONAME, RTLD_NOW | RTLD_GLOBAL);
    if (library != NULL) return start_python(library, NULL);
    fail("this FMU needs Python: %s and %s, or %s on the search path of libraries", PYTHON_LIBRARY, STANDARD_LIBRARY,
         PYTHON_SONAME);
    return 0;
}

/* In the constructor, as the loader's lock keeps FMUs that are loaded by several threads from starting two Pythons. */
__attribute__((constructor)) static void open_wrapper(void) {
    char path[PATH_MAX + 16];
    Dl_info own;
    if (!dladdr(&wrapper, &own) || realpath(own.dli_fname, own_path) == NULL) {
        fail("this library cannot find its own place");
        return;
    }
    if (!program_has_python() && !share_private_python() && !open_python()) return;
    snprintf(path, sizeof path, "%.*s.pythonfmu.so", (int)(strlen(own_path) - strlen(".so")), own_path);
    wrapper = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (wrapper == NULL) fail("%s", dlerror());
}

__attribute__((destructor)) static void close_wrapper(void) {
    if (wrapper != NULL) dlclose(wrapper);
}

static int is_resources(const char *path) {
    char file[PATH_MAX * 2];
    snprintf(file, sizeof file, "%s/slavemodule.txt", path);
    return access(file, R_OK) == 0;
}

static void decode(const char *uri, char *path, size_t size) {
    unsigned code = 0;
    size_t length = 0;
    if (strncmp(uri, "file:", 5) == 0) uri += 5;
    if (strncmp(uri, "//", 2) == 0) uri += 2 + strcspn(uri + 2, "/");
    for (; *uri != '\0' && length < size - 1; uri++) {
        int escaped = *uri == '%' && strspn(uri + 1, "0123456789abcdefABCDEF") >= 2;
        if (escaped) sscanf(uri + 1, "%2x", &code);
        path[length++] = escaped ? (char)code : *uri;
        if (escaped) uri += 2;
    }
    path[length] = '\0';
}

/* pythonfmu decodes nothing but %20, even in a decoded path, and crashes where it finds no resources; some importers
   encode nothing, or name a folder that they do not fill. */
static int find_resources(const char *uri, char *path, size_t size) {
    if (uri != NULL) decode(uri, path, size);
    if (uri == NULL || !is_resources(path)) {
        snprintf(path, size, "%s", own_path);
        for (int up = 0; up < 3; up++)
            if (strrchr(path, '/') != NULL) *strrchr(path, '/') = '\0';
        strncat(path, "/resources", size - strlen(path) - 1);
    }
    if (!is_resources(path)) fail("no resources of this FMU in %s", path);
    else if (strstr(path, "%20") != NULL) fail("%s: pythonfmu cannot read from a folder with %%20 in its name", path);
    else return 1;
    return 0;
}

PUBLIC const char *fmi2GetTypesPlatform(void) { return "default"; }
PUBLIC const char *fmi2GetVersion(void) { return "2.0"; }

PUBLIC Component fmi2Instantiate(const char *name, int type, const char *guid, const char *uri,
                                 const Callbacks *callbacks, int visible, int logging) {
    char path[PATH_MAX + 16];
    Component (*next)(const char *, int, const char *, const char *, const Callbacks *, int, int) = NULL;
    if (wrapper != NULL && find_resources(uri, path, sizeof path)) *(void **)&next = dlsym(wrapper, "fmi2Instantiate");
    if (next != NULL) return next(name, type, guid, path, callbacks, visible, logging);
    if (callbacks != NULL && callbacks->logger != NULL)
        callbacks->logger(callbacks->environment, name, FMI_ERROR, "logStatusError", "%s", failure);
    return NULL;
}

PUBLIC void fmi2FreeInstance(Component c) {
    void (*next)(Component);
    *(void **)&next = dlsym(wrapper, "fmi2FreeInstance");
    if (next != NULL) next(c);
}

#define HAND_ON(name, parameters, ...)                             \
    PUBLIC int name parameters {                                   \
        static int(*next) parameters;                              \
        if (next == NULL) *(void **)&next = dlsym(wrapper, #name); \
        return next == NULL ? FMI_ERROR : next(__VA_ARGS__);       \
    }

HAND_ON(fmi2SetDebugLogging, (Component c, int on, size_t n, const char *const categories[]), c, on, n, categories)
HAND_ON(fmi2SetupExperiment, (Component c, int given, double tolerance, double start, int ends, double stop), c, given,
        tolerance, start, ends, stop)
HAND_ON(fmi2EnterInitializationMode, (Component c), c)
HAND_ON(fmi2ExitInitializationMode, (Component c), c)
HAND_ON(fmi2Terminate, (Component c), c)
HAND_ON(fmi2Reset, (Component c), c)
HAND_ON(fmi2GetReal, (Component c, const Reference r[], size_t n, double v[]), c, r, n, v)
HAND_ON(fmi2GetInteger, (Component c, const Reference r[], size_t n, int v[]), c, r, n, v)
HAND_ON(fmi2GetBoolean, (Component c, const Reference r[], size_t n, int v[]), c, r, n, v)
HAND_ON(fmi2GetString, (Component c, const Reference r[], size_t n, const char *v[]), c, r, n, v)
HAND_ON(fmi2SetReal, (Component c, const Reference r[], size_t n, const double v[]), c, r, n, v)
HAND_ON(fmi2SetInteger, (Component c, const Reference r[], size_t n, const int v[]), c, r, n, v)
HAND_ON(fmi2SetBoolean, (Component c, const Reference r[], size_t n, const int v[]), c, r, n, v)
HAND_ON(fmi2SetString, (Component c, const Reference r[], size_t n, const char *const v[]), c, r, n, v)
HAND_ON(fmi2GetFMUstate, (Component c, State *s), c, s)
HAND_ON(fmi2SetFMUstate, (Component c, State s), c, s)
HAND_ON(fmi2FreeFMUstate, (Component c, State *s), c, s)
HAND_ON(fmi2SerializedFMUstateSize, (Component c, State s, size_t *size), c, s, size)
HAND_ON(fmi2SerializeFMUstate, (Component c, State s, char bytes[], size_t size), c, s, bytes, size)
HAND_ON(fmi2DeSerializeFMUstate, (Component c, const char bytes[], size_t size, State *s), c, bytes, size, s)
HAND_ON(fmi2GetDirectionalDerivative,
        (Component c, const Reference u[], size_t nu, const Reference k[], size_t nk, const double dk[], double du[]),
        c, u, nu, k, nk, dk, du)
HAND_ON(fmi2SetRealInputDerivatives,
        (Component c, const Reference r[], size_t n, const int order[], const double v[]), c, r, n, order, v)
HAND_ON(fmi2GetRealOutputDerivatives, (Component c, const Reference r[], size_t n, const int order[], double v[]), c,
        r, n, order, v)
HAND_ON(fmi2DoStep, (Component c, double time, double step, int keep), c, time, step, keep)
HAND_ON(fmi2CancelStep, (Component c), c)
HAND_ON(fmi2GetStatus, (Component c, int kind, int *v), c, kind, v)
HAND_ON(fmi2GetRealStatus, (Component c, int kind, double *v), c, kind, v)
HAND_ON(fmi2GetIntegerStatus, (Component c, int kind, int *v), c, kind, v)
HAND_ON(fmi2GetBooleanStatus, (Component c, int kind, int *v), c, kind, v)
HAND_ON(fmi2GetStringStatus, (Component c, int kind, const char **v), c, kind, v)
