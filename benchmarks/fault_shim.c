/* Fails, cuts short or kills at the n-th call that writes below a folder: LD_PRELOAD of a process.
 *
 * faults_arm(folder, n, mode): counting begins; mode 1 kills the process at the n-th call, in the
 * middle of the bytes of a write; mode 2 fails it with EIO; mode 3 fails it and every later call
 * that needs room with ENOSPC. faults_count(): calls so far. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

static char root[PATH_MAX];
static long target, count;
static int mode;
enum { KILL = 1, EIO_ONCE = 2, FULL = 3 };
#define REAL(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))

void faults_arm(const char *folder, long n, int how) {
    strncpy(root, folder, sizeof root - 1);
    target = n; mode = how; count = 0;
}
long faults_count(void) { return count; }

static int below(const char *path) {
    size_t length = strlen(root);
    return length && strncmp(path, root, length) == 0 && (path[length] == '/' || !path[length]);
}
static int of_path(int folder, const char *path) {
    char whole[2 * PATH_MAX], base[PATH_MAX], link[64];
    ssize_t length;
    if (!root[0] || !path) return 0;
    if (path[0] == '/') return below(path);
    if (folder == AT_FDCWD) { if (!getcwd(base, sizeof base)) return 0; }
    else {
        snprintf(link, sizeof link, "/proc/self/fd/%d", folder);
        length = readlink(link, base, sizeof base - 1);
        if (length < 0) return 0;
        base[length] = 0;
    }
    snprintf(whole, sizeof whole, "%s/%s", base, path);
    return below(whole);
}
static int of_file(int file) {
    char link[64], path[PATH_MAX];
    ssize_t length;
    if (!root[0]) return 0;
    snprintf(link, sizeof link, "/proc/self/fd/%d", file);
    length = readlink(link, path, sizeof path - 1);
    if (length < 0) return 0;
    path[length] = 0;
    return below(path);
}
/* Count a call; return the error that it shall end with, 0 for none, -1 to kill. */
static int due(int mine, int needs_room) {
    if (!mine) return 0;
    long now = ++count;
    if (mode == FULL) return target && now >= target && needs_room ? ENOSPC : 0;
    if (now != target) return 0;
    return mode == KILL ? -1 : EIO;
}
static void end(void) { kill(getpid(), SIGKILL); for (;;) pause(); }
#define GUARD(mine, room)                                      \
    do {                                                       \
        int fault = due(mine, room);                           \
        if (fault < 0) end();                                  \
        if (fault) { errno = fault; return -1; }               \
    } while (0)

ssize_t write(int file, const void *bytes, size_t size) {
    int fault = due(of_file(file), 1);
    if (fault < 0) { if (size > 1) REAL(write)(file, bytes, size / 2); end(); }
    if (fault) { errno = fault; return -1; }
    return REAL(write)(file, bytes, size);
}
ssize_t pwrite64(int file, const void *bytes, size_t size, off64_t at) {
    GUARD(of_file(file), 1); return REAL(pwrite64)(file, bytes, size, at);
}
ssize_t writev(int file, const struct iovec *parts, int many) {
    GUARD(of_file(file), 1); return REAL(writev)(file, parts, many);
}
int fsync(int file) { GUARD(of_file(file), 1); return REAL(fsync)(file); }
int fdatasync(int file) { GUARD(of_file(file), 1); return REAL(fdatasync)(file); }
int ftruncate64(int file, off64_t size) { GUARD(of_file(file), 1); return REAL(ftruncate64)(file, size); }
int rename(const char *from, const char *to) {
    GUARD(of_path(AT_FDCWD, to), 0); return REAL(rename)(from, to);
}
int renameat(int a, const char *from, int b, const char *to) {
    GUARD(of_path(b, to), 0); return REAL(renameat)(a, from, b, to);
}
int renameat2(int a, const char *from, int b, const char *to, unsigned flags) {
    GUARD(of_path(b, to), 0); return REAL(renameat2)(a, from, b, to, flags);
}
int mkdir(const char *path, mode_t bits) {
    GUARD(of_path(AT_FDCWD, path), 1); return REAL(mkdir)(path, bits);
}
int unlink(const char *path) { GUARD(of_path(AT_FDCWD, path), 0); return REAL(unlink)(path); }
int unlinkat(int folder, const char *path, int flags) {
    GUARD(of_path(folder, path), 0); return REAL(unlinkat)(folder, path, flags);
}
int rmdir(const char *path) { GUARD(of_path(AT_FDCWD, path), 0); return REAL(rmdir)(path); }
int close(int file) {
    /* only files that were written to: closing what was read says nothing */
    int flags = root[0] ? fcntl(file, F_GETFL) : -1;
    int fault = due(flags >= 0 && (flags & O_ACCMODE) != O_RDONLY && of_file(file), 1);
    if (fault < 0) end();
    int result = REAL(close)(file);
    if (fault) { errno = fault; return -1; }
    return result;
}
