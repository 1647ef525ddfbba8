/* For LD_PRELOAD: ends a program by SIGKILL at its KILL_AT-th operation on files whose name has ".h5" in it (KILL_MODE: before it, or
   half way through a write). Operations: opening for writing, writing, renaming, removing, locking. KILL_AT=0 counts only: the
   number stands in KILL_LOG. After a file has got its name it is copied to KILL_COPY: what whoever reads it may rely on.
   The clock stands still, but goes a quarter of a second forward whenever it is looked at: there are many flushes, and as many in every
   run, however fast or busy the machine is.
   cc -shared -fPIC -o kill_at_write.so kill_at_write.c -ldl */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/types.h>
#include <time.h>
#include <unistd.h>

static long operations = 0;

#define REAL(type, name, ...) static type (*real)(__VA_ARGS__); if (!real) real = (type (*)(__VA_ARGS__)) dlsym(RTLD_NEXT, #name)

static int ours(const char *name) { return strstr(name, ".h5") != NULL; }

static int ours_by_number(int file)
{
   char link[64], name[4096];
   ssize_t length;
   snprintf(link, sizeof link, "/proc/self/fd/%d", file);
   length = readlink(link, name, sizeof name - 1);
   if (length < 0) return 0;
   name[length] = 0;
   return ours(name);
}

static ssize_t plain_write(int file, const void *bytes, size_t count)
{
   REAL(ssize_t, write, int, const void *, size_t);
   return real(file, bytes, count);
}

static int plain_open(const char *name, int flags)
{
   REAL(int, open, const char *, int, ...);
   return real(name, flags, 0644);
}

static void note(void)
{
   char line[40];
   int file = plain_open(getenv("KILL_LOG"), O_WRONLY | O_CREAT | O_TRUNC);
   if (file < 0) return;
   plain_write(file, line, (size_t) snprintf(line, sizeof line, "%ld\n", operations));
   close(file);
}

static int due(void)
{
   operations++;
   note();
   return operations == atol(getenv("KILL_AT"));
}

static void end(void)
{
   kill(getpid(), SIGKILL);
   for (;;) pause();
}

int open(const char *name, int flags, ...)
{
   REAL(int, open, const char *, int, ...);
   va_list more;
   mode_t mode;
   va_start(more, flags);
   mode = flags & O_CREAT ? va_arg(more, mode_t) : 0;
   va_end(more);
   if ((flags & (O_WRONLY | O_RDWR)) && ours(name) && due()) end();
   return real(name, flags, mode);
}

ssize_t write(int file, const void *bytes, size_t count)
{
   if (ours_by_number(file) && due()) {
      if (!strcmp(getenv("KILL_MODE"), "half")) plain_write(file, bytes, count / 2);
      end();
   }
   return plain_write(file, bytes, count);
}

int rename(const char *from, const char *to)
{
   REAL(int, rename, const char *, const char *);
   char bytes[65536];
   int failed, source, copy;
   ssize_t count;
   if (!ours(to)) return real(from, to);
   if (due()) end();
   failed = real(from, to);
   source = plain_open(to, O_RDONLY);
   copy = plain_open(getenv("KILL_COPY"), O_WRONLY | O_CREAT | O_TRUNC);
   while (source >= 0 && copy >= 0 && (count = read(source, bytes, sizeof bytes)) > 0) plain_write(copy, bytes, (size_t) count);
   close(source);
   close(copy);
   return failed;
}

int unlink(const char *name)
{
   REAL(int, unlink, const char *);
   if (ours(name) && due()) end();
   return real(name);
}

int flock(int file, int operation)
{
   REAL(int, flock, int, int);
   if (ours_by_number(file) && due()) end();
   return real(file, operation);
}

int clock_gettime(clockid_t clock, struct timespec *now)
{
   REAL(int, clock_gettime, clockid_t, struct timespec *);
   static long quarters = 0;
   int failed = real(clock, now);
   quarters++;
   now->tv_sec = 1000000 + quarters / 4;
   now->tv_nsec = quarters % 4 * 250000000;
   return failed;
}
