/* What a result file needs of POSIX and Fortran has no words for: files that take each other's place, locks, checked writes.
   Procedures return 0, or the number of the error as errno has it. posix_files.f90 describes them. */
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

/* All bytes, however few the system takes at a time. -2: there is no such output. */
int unilat_write_all(int descriptor, const char *bytes, long count)
{
   while (count > 0) {
      ssize_t written = write(descriptor, bytes, (size_t) count);
      if (written < 0 && errno == EINTR) continue;
      if (written < 0) return errno == EBADF ? -2 : errno;
      bytes += written;
      count -= written;
   }
   return 0;
}

/* The words of the system for an error. */
void unilat_error_text(int number, char *text, long size)
{
   snprintf(text, (size_t) size, "%s", strerror(number));
}

/* What a name stands for in the end: links are followed, also one that leads to nothing yet. */
int unilat_resolve(const char *name, char *target, long size)
{
   char link[PATH_MAX], next[2 * PATH_MAX];
   int level;
   if (strlen(name) >= PATH_MAX) return ENAMETOOLONG;
   strcpy(link, name);
   for (level = 0; level < 40; level++) {
      char found[PATH_MAX];
      const char *slash = strrchr(link, '/');
      ssize_t length = readlink(link, found, sizeof found - 1);
      if (length < 0) {
         if (strlen(link) >= (size_t) size) return ENAMETOOLONG;
         strcpy(target, link);
         return 0;
      }
      found[length] = 0;
      if (found[0] == '/' || !slash)
         snprintf(next, sizeof next, "%s", found);
      else
         snprintf(next, sizeof next, "%.*s%s", (int) (slash - link + 1), link, found);
      if (strlen(next) >= sizeof link) return ENAMETOOLONG;
      strcpy(link, next);
   }
   return ELOOP;
}

/* kind: 0 nothing of that name, 1 an empty file, 2 a file, 3 a folder, 4 anything else. The error where it may not be replaced. */
int unilat_look_at(const char *name, int *kind)
{
   struct stat what;
   *kind = 0;
   if (stat(name, &what)) return errno == ENOENT ? 0 : errno;
   *kind = S_ISDIR(what.st_mode) ? 3 : !S_ISREG(what.st_mode) ? 4 : what.st_size == 0 ? 1 : 2;
   return access(name, W_OK) ? errno : 0;
}

/* Takes a lock that ends with the process, whatever ends it. -1: another process has it, and `owner` says which one.
   A file system that knows no locks gives none. */
int unilat_lock(const char *name, int *descriptor, char *owner, long size)
{
   const struct timespec millisecond = {0, 1000000};
   for (int waits = 0;; waits++) {
      struct stat opened, named;
      char self[300] = "", host[200] = "";
      int file = open(name, O_RDWR | O_CREAT | O_CLOEXEC, 0666);
      owner[0] = 0;
      if (file < 0) return errno;
      if (flock(file, LOCK_EX | LOCK_NB) && errno == EWOULDBLOCK) {
         ssize_t length = read(file, owner, (size_t) size - 1);
         owner[length > 0 ? length : 0] = 0;
         close(file);
         /* The owner writes its name just after it has the lock: for a second at most, it is waited for. */
         if (length == 0 && waits < 1000 && nanosleep(&millisecond, NULL) == 0) continue;
         return -1;
      }
      /* The owner before may have removed the file since it was opened. */
      if (fstat(file, &opened) == 0 && stat(name, &named) == 0 && opened.st_ino == named.st_ino && opened.st_dev == named.st_dev) {
         gethostname(host, sizeof host - 1);
         snprintf(self, sizeof self, "process %ld on %s", (long) getpid(), host);
         if (ftruncate(file, 0) == 0) unilat_write_all(file, self, (long) strlen(self));
         *descriptor = file;
         return 0;
      }
      close(file);
   }
}

/* Gives the lock back. */
void unilat_unlock(const char *name, int descriptor)
{
   unlink(name);
   close(descriptor);
}

/* Whether a file is still the one that unilat_put_in_place left: mark has its device, inode and size. 0: it is, 1: nothing is there,
   2: it was changed in its place, 3: it is another file. */
int unilat_compare(const char *name, const long mark[3])
{
   struct stat what;
   if (stat(name, &what)) return 1;
   if ((long) what.st_dev != mark[0] || (long) what.st_ino != mark[1]) return 3;
   return (long) what.st_size != mark[2] ? 2 : 0;
}

/* Writes a file beside another one and lets it take that one's place: whatever happens on the way, there is the old or the new file,
   and never a part of one. */
int unilat_put_in_place(const char *name, const char *beside, const char *bytes, long count, long mark[3])
{
   struct stat old, what;
   int failed, file = open(beside, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
   if (file < 0) return errno;
   failed = unilat_write_all(file, bytes, count);
   if (!failed && stat(name, &old) == 0 && fchmod(file, old.st_mode & 0777)) failed = 0;   /* not all file systems have modes */
   if (!failed && fstat(file, &what)) failed = errno;
   if (close(file) && !failed) failed = errno;
   if (!failed && rename(beside, name)) failed = errno;
   if (failed) {
      unlink(beside);
      return failed;
   }
   mark[0] = (long) what.st_dev;
   mark[1] = (long) what.st_ino;
   mark[2] = (long) what.st_size;
   return 0;
}

/* Another name for a file; nothing of that name is there. */
int unilat_rename(const char *from, const char *to)
{
   return rename(from, to) ? errno : 0;
}
