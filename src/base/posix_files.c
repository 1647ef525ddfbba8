/* POSIX file operations that Fortran lacks: atomic replacement of files, locks, checked writes. Procedures return 0 or errno.
   posix_files.f90 describes them. */
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

/* Writes all bytes, even if the system accepts only some at a time. -2: the output is closed. */
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

/* The system's message for an error number. */
void unilat_error_text(int number, char *text, long size)
{
   snprintf(text, (size_t) size, "%s", strerror(number));
}

/* Name of the file to which a name leads through symbolic links; this file need not exist. */
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

/* kind: 0 no file, 1 an empty file, 2 a file, 3 a folder, 5 a pipe, 4 anything else. Returns errno if it may not be replaced. */
int unilat_look_at(const char *name, int *kind)
{
   struct stat what;
   *kind = 0;
   if (stat(name, &what)) return errno == ENOENT ? 0 : errno;
   *kind = S_ISDIR(what.st_mode) ? 3 : S_ISFIFO(what.st_mode) ? 5 : !S_ISREG(what.st_mode) ? 4 : what.st_size == 0 ? 1 : 2;
   return access(name, W_OK) ? errno : 0;
}

/* Takes a lock that the system removes when the process ends for any reason. -1: another process has the lock, named in `owner`.
   On a file system without locks no lock is taken. */
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
         /* The owner writes its name just after taking the lock: wait for the name for at most one second. */
         if (length == 0 && waits < 1000 && nanosleep(&millisecond, NULL) == 0) continue;
         return -1;
      }
      /* The previous owner may have removed the lock file after it was opened here. */
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

/* Releases the lock. */
void unilat_unlock(const char *name, int descriptor)
{
   unlink(name);
   close(descriptor);
}

/* Compares a file with the one written by unilat_put_in_place, whose device, inode and size are in mark. 0: the same, 1: missing,
   2: the same file with another size, 3: another file. */
int unilat_compare(const char *name, const long mark[3])
{
   struct stat what;
   if (stat(name, &what)) return 1;
   if ((long) what.st_dev != mark[0] || (long) what.st_ino != mark[1]) return 3;
   return (long) what.st_size != mark[2] ? 2 : 0;
}

/* Writes a temporary file `beside` and renames it to `name`: if the program is ended at any moment, either the old or the new file
   exists, never a part of one. */
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

/* Overwrites bytes of a file without making it longer: this needs no room on the disk, but for file systems that copy on writing. */
int unilat_overwrite(const char *name, long at, const char *bytes, long count)
{
   ssize_t written;
   int failed = 0, file = open(name, O_WRONLY | O_CLOEXEC);
   if (file < 0) return errno;
   written = pwrite(file, bytes, (size_t) count, (off_t) at);
   if (written != count) failed = written < 0 ? errno : ENOSPC;
   if (close(file) && !failed) failed = errno;
   return failed;
}

/* Renames a file; no file has the new name. */
int unilat_rename(const char *from, const char *to)
{
   return rename(from, to) ? errno : 0;
}
