/* Lets User-mode Linux run on processors whose extended state is larger than it knows (AMX).
 *
 * It saves and sets the state of its processes through ptrace in a buffer of 2696 bytes, and Linux refuses
 * to set less than all of it ("ptrace set fp regs failed, errno = 14"). Loaded before the C library, this
 * ptrace passes what User-mode Linux knows and leaves the rest in its initial state, in which a guest that never
 * asks for AMX has it anyway.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <elf.h>
#include <stdint.h>
#include <string.h>
#include <sys/ptrace.h>
#include <sys/types.h>
#include <sys/uio.h>

/* Where XSAVE's header has the bits of the components, and those of the tiles (17 and 18). */
enum { HEADER = 512 };
static const uint64_t TILES = 3ull << 17;

typedef long trace(int request, pid_t process, void *address, void *data);

long ptrace(enum __ptrace_request request, ...) {
    static trace *real;
    static unsigned char whole[1 << 16] __attribute__((aligned(64)));
    __builtin_va_list arguments;
    __builtin_va_start(arguments, request);
    pid_t process = __builtin_va_arg(arguments, pid_t);
    void *address = __builtin_va_arg(arguments, void *);
    void *data = __builtin_va_arg(arguments, void *);
    __builtin_va_end(arguments);
    if (!real) real = (trace *)dlsym(RTLD_NEXT, "ptrace");
    int sets = request == PTRACE_SETREGSET;
    if ((!sets && request != PTRACE_GETREGSET) || (uintptr_t)address != NT_X86_XSTATE)
        return real(request, process, address, data);
    struct iovec *known = data, all = { whole, sizeof whole };
    long result = real(PTRACE_GETREGSET, process, address, &all);
    if (result < 0) return result;
    size_t length = known->iov_len < all.iov_len ? known->iov_len : all.iov_len;
    if (!sets) {
        memcpy(known->iov_base, whole, length);
        known->iov_len = length;
        return result;
    }
    memcpy(whole, known->iov_base, length);
    uint64_t components;
    memcpy(&components, whole + HEADER, sizeof components);
    components &= ~TILES;
    memcpy(whole + HEADER, &components, sizeof components);
    return real(PTRACE_SETREGSET, process, address, &all);
}
