/* Signals and limits that end a run: the handlers only record the signal, so that the run can end regularly and keep its results.
   run_end.f90 describes them. */
#define _GNU_SOURCE
#include <errno.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/time.h>
#include <unistd.h>

/* In the order of the names in run_end.f90. */
static const int watched[] = {SIGTERM, SIGINT, SIGHUP, SIGXCPU, SIGXFSZ, SIGPIPE, SIGALRM};
enum { n_watched = sizeof watched / sizeof watched[0], once = 3 };

static volatile sig_atomic_t received = 0;   /* index of the first signal received, from 1; 0: none */
static volatile sig_atomic_t ended = 0;      /* 1: the program ends regularly, with its own exit code */

static void take_note(int number)
{
   int i;
   for (i = 0; i < n_watched; i++)
      if (watched[i] == number && !received) received = i + 1;
}

/* Installs the handlers. Signals that are ignored at the start (nohup) stay ignored. The first `once` signals in the list
   end the program immediately if they are received again. seconds: limit of the elapsed time, 0: none. */
void unilat_watch(double seconds)
{
   struct sigaction action, before;
   struct itimerval limit;
   int i;
   for (i = 0; i < n_watched; i++) {
      if (watched[i] == SIGALRM && !(seconds > 0)) continue;
      if (sigaction(watched[i], NULL, &before) == 0 && before.sa_handler == SIG_IGN) continue;
      memset(&action, 0, sizeof action);
      action.sa_handler = take_note;
      sigemptyset(&action.sa_mask);
      action.sa_flags = SA_RESTART | (i < once ? SA_RESETHAND : 0);
      sigaction(watched[i], &action, NULL);
   }
   if (!(seconds > 0)) return;
   if (seconds > 1e8) seconds = 1e8;
   memset(&limit, 0, sizeof limit);
   limit.it_value.tv_sec = (time_t) seconds;
   limit.it_value.tv_usec = (suseconds_t) (1e6 * (seconds - (double) limit.it_value.tv_sec));
   if (!limit.it_value.tv_sec && !limit.it_value.tv_usec) limit.it_value.tv_usec = 1;
   setitimer(ITIMER_REAL, &limit, NULL);
}

/* Index in `watched` of the first signal received, from 1; 0: none. */
int unilat_received(void)
{
   return received;
}

/* The Fortran runtime ends the program with code 1 if an allocation fails; but code 1 means an error in the deck. */
static int code_without_memory, code_otherwise;

static void correct_code(int no_memory)
{
   static const char told[] = "unilat: there is not enough memory\n";
   ssize_t written = no_memory && !ended ? write(2, told, sizeof told - 1) : 0;
   if (!ended) _exit(no_memory && written ? code_without_memory : code_otherwise);
}

#ifdef __GLIBC__
static void at_exit(int code, void *unused)
{
   (void) unused;
   correct_code(code == 1);      /* libgfortran: 1 system errors, here only failed allocations; 2 all others */
}
#else
static void at_exit(void)
{
   correct_code(errno == ENOMEM);
}
#endif

/* Exit codes of a program that the Fortran runtime ends. */
void unilat_guard_exit(int without_memory, int otherwise)
{
   code_without_memory = without_memory;
   code_otherwise = otherwise;
#ifdef __GLIBC__
   on_exit(at_exit, NULL);
#else
   atexit(at_exit);
#endif
}

/* From this call on the exit codes are the program's own. */
void unilat_ends_by_itself(void)
{
   ended = 1;
}

/* Ensures a stack of the given size; returns 1 if the system's limit is smaller. */
int unilat_has_stack(long bytes)
{
   struct rlimit limit;
   if (getrlimit(RLIMIT_STACK, &limit) || limit.rlim_cur == RLIM_INFINITY || limit.rlim_cur >= (rlim_t) bytes) return 0;
   if (limit.rlim_max != RLIM_INFINITY && limit.rlim_max < (rlim_t) bytes) return 1;
   limit.rlim_cur = (rlim_t) bytes;
   return setrlimit(RLIMIT_STACK, &limit) != 0;
}
