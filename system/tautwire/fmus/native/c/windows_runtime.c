/* What a Windows library needs beside ucrtbase.dll: an entry point, snprintf, and probes of the stack. */

#include <stdarg.h>
#include <stddef.h>
#define STANDARD_SNPRINTF 2
int __stdio_common_vsprintf(unsigned long long options, char *buffer, size_t size, const char *format, void *locale,
                            va_list arguments);

int _fltused = 1;

int DllMainCRTStartup(void *module, unsigned long reason, void *reserved) {
  (void)module, (void)reason, (void)reserved;
  return 1;
}

int snprintf(char *buffer, size_t size, const char *format, ...) {
  va_list arguments;
  int count;
  va_start(arguments, format);
  count = __stdio_common_vsprintf(STANDARD_SNPRINTF, buffer, size, format, NULL, arguments);
  va_end(arguments);
  return count;
}

/* Touches every page of a large stack frame, whose size is in rax; keeps all registers. */
__asm__(
    ".globl ___chkstk_ms\n"
    "___chkstk_ms:\n"
    "  pushq %rcx\n"
    "  pushq %rax\n"
    "  leaq 24(%rsp), %rcx\n"
    "1:\n"
    "  cmpq $4096, %rax\n"
    "  jb 2f\n"
    "  subq $4096, %rcx\n"
    "  testq %rcx, (%rcx)\n"
    "  subq $4096, %rax\n"
    "  jmp 1b\n"
    "2:\n"
    "  subq %rax, %rcx\n"
    "  testq %rcx, (%rcx)\n"
    "  popq %rax\n"
    "  popq %rcx\n"
    "  ret\n");
