/* Shared libraries and threads of the system: POSIX or Windows. */
#include <string.h>

#ifdef _WIN32
#include <windows.h>

static void *open_library(const char *path) { return (void *)LoadLibraryA(path); }

static void close_library(void *handle) { FreeLibrary((HMODULE)handle); }

/* ISO C has no conversion between pointers to functions and to objects; both systems promise that the bytes fit. */
static void *symbol_of(void *handle, const char *name) {
    FARPROC function = GetProcAddress((HMODULE)handle, name);
    void *symbol;
    memcpy(&symbol, &function, sizeof symbol);
    return symbol;
}

static const char *loading_error(void) { return "the Windows library or function cannot be loaded"; }

static DWORD WINAPI call(LPVOID function) {
    void (*called)(void);
    memcpy(&called, function, sizeof called);
    called();
    return 0;
}

/* Calls a function in a thread of its own; 0 where there is none. */
static int call_in_thread(void (*function)(void)) {
    HANDLE thread = CreateThread(NULL, 0, call, &function, 0, NULL);
    return thread != NULL && WaitForSingleObject(thread, INFINITE) == WAIT_OBJECT_0 && CloseHandle(thread);
}
#else
#include <dlfcn.h>
#include <pthread.h>

static void *open_library(const char *path) { return dlopen(path, RTLD_NOW | RTLD_LOCAL); }

static void close_library(void *handle) { dlclose(handle); }

static void *symbol_of(void *handle, const char *name) { return dlsym(handle, name); }

static const char *loading_error(void) { return dlerror(); }

static void *call(void *function) {
    void (*called)(void);
    memcpy(&called, function, sizeof called);
    called();
    return NULL;
}

/* Calls a function in a thread of its own; 0 where there is none. */
static int call_in_thread(void (*function)(void)) {
    pthread_t thread;
    return !pthread_create(&thread, NULL, call, &function) && !pthread_join(thread, NULL);
}
#endif
