#include "tests/haptics/forbidden_calls.h"

#include <atomic>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define PALPATE_SANITIZED 1
#endif

namespace palpate::test {
namespace {

thread_local bool watched = false;
std::atomic<bool> counting{true};
std::atomic<int> calls{0};
std::atomic<const char*> first_name{nullptr};

}  // namespace

#ifndef PALPATE_SANITIZED
static void note(const char* name) noexcept {
  if (!watched || !counting.load(std::memory_order_relaxed)) return;
  const char* none = nullptr;
  first_name.compare_exchange_strong(none, name);
  calls.fetch_add(1);
}

bool ForbiddenCalls::can_watch() {
  return true;
}
#else
bool ForbiddenCalls::can_watch() {
  return false;
}
#endif

void ForbiddenCalls::watch_this_thread(bool on) {
  watched = on;
}
void ForbiddenCalls::count(bool on) {
  counting = on;
}
int ForbiddenCalls::counted() {
  return calls.load();
}
const char* ForbiddenCalls::first() {
  const char* name = first_name.load();
  return name ? name : "";
}
void ForbiddenCalls::forget() {
  calls = 0;
  first_name = nullptr;
}

}  // namespace palpate::test

#ifndef PALPATE_SANITIZED

#include <dlfcn.h>
#include <fcntl.h>
#include <pthread.h>
#include <semaphore.h>
#include <unistd.h>

#include <atomic>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>

using palpate::test::note;

namespace {

/// The C library's own function of that name, stored in `known`. Two threads may look it up at
/// once. A function-local static would make the second wait by syscall(), which is one of the
/// functions replaced here.
template <class Function>
Function real(std::atomic<Function>& known, const char* name) {
  Function found = known.load(std::memory_order_relaxed);
  if (!found) {
    found = reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
    known.store(found, std::memory_order_relaxed);
  }
  return found;
}

}  // namespace

// The allocator's own names: dlsym() allocates, so it can not be used to find them.
extern "C" {
void* __libc_malloc(size_t);
void* __libc_calloc(size_t, size_t);
void* __libc_realloc(void*, size_t);
void __libc_free(void*);
void* __libc_memalign(size_t, size_t);

void* malloc(size_t size) noexcept {
  note("malloc");
  return __libc_malloc(size);
}
void* calloc(size_t count, size_t size) noexcept {
  note("calloc");
  return __libc_calloc(count, size);
}
void* realloc(void* memory, size_t size) noexcept {
  note("realloc");
  return __libc_realloc(memory, size);
}
void free(void* memory) noexcept {
  note("free");
  __libc_free(memory);
}
void* aligned_alloc(size_t alignment, size_t size) noexcept {
  note("aligned_alloc");
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** memory, size_t alignment, size_t size) noexcept {
  note("posix_memalign");
  *memory = __libc_memalign(alignment, size);
  return *memory ? 0 : 12;  // ENOMEM
}

int pthread_mutex_lock(pthread_mutex_t* mutex) noexcept {
  note("pthread_mutex_lock");
  static constinit std::atomic<int (*)(pthread_mutex_t*)> known{nullptr};
  const auto next = real(known, "pthread_mutex_lock");
  return next(mutex);
}
int pthread_mutex_trylock(pthread_mutex_t* mutex) noexcept {
  note("pthread_mutex_trylock");
  static constinit std::atomic<int (*)(pthread_mutex_t*)> known{nullptr};
  const auto next = real(known, "pthread_mutex_trylock");
  return next(mutex);
}
int pthread_cond_wait(pthread_cond_t* condition, pthread_mutex_t* mutex) {
  note("pthread_cond_wait");
  static constinit std::atomic<int (*)(pthread_cond_t*, pthread_mutex_t*)> known{nullptr};
  const auto next = real(known, "pthread_cond_wait");
  return next(condition, mutex);
}
int pthread_cond_signal(pthread_cond_t* condition) noexcept {
  note("pthread_cond_signal");
  static constinit std::atomic<int (*)(pthread_cond_t*)> known{nullptr};
  const auto next = real(known, "pthread_cond_signal");
  return next(condition);
}
int pthread_cond_broadcast(pthread_cond_t* condition) noexcept {
  note("pthread_cond_broadcast");
  static constinit std::atomic<int (*)(pthread_cond_t*)> known{nullptr};
  const auto next = real(known, "pthread_cond_broadcast");
  return next(condition);
}
int pthread_rwlock_rdlock(pthread_rwlock_t* lock) noexcept {
  note("pthread_rwlock_rdlock");
  static constinit std::atomic<int (*)(pthread_rwlock_t*)> known{nullptr};
  const auto next = real(known, "pthread_rwlock_rdlock");
  return next(lock);
}
int pthread_rwlock_wrlock(pthread_rwlock_t* lock) noexcept {
  note("pthread_rwlock_wrlock");
  static constinit std::atomic<int (*)(pthread_rwlock_t*)> known{nullptr};
  const auto next = real(known, "pthread_rwlock_wrlock");
  return next(lock);
}
int sem_wait(sem_t* semaphore) {
  note("sem_wait");
  static constinit std::atomic<int (*)(sem_t*)> known{nullptr};
  const auto next = real(known, "sem_wait");
  return next(semaphore);
}

int printf(const char* format, ...) {
  note("printf");
  va_list arguments;
  va_start(arguments, format);
  const int written = vfprintf(stdout, format, arguments);
  va_end(arguments);
  return written;
}
int fprintf(FILE* file, const char* format, ...) {
  note("fprintf");
  va_list arguments;
  va_start(arguments, format);
  const int written = vfprintf(file, format, arguments);
  va_end(arguments);
  return written;
}
int puts(const char* text) {
  note("puts");
  static constinit std::atomic<int (*)(const char*)> known{nullptr};
  const auto next = real(known, "puts");
  return next(text);
}
size_t fwrite(const void* data, size_t size, size_t count, FILE* file) {
  note("fwrite");
  static constinit std::atomic<size_t (*)(const void*, size_t, size_t, FILE*)> known{nullptr};
  const auto next = real(known, "fwrite");
  return next(data, size, count, file);
}
ssize_t write(int file, const void* data, size_t size) {
  note("write");
  static constinit std::atomic<ssize_t (*)(int, const void*, size_t)> known{nullptr};
  const auto next = real(known, "write");
  return next(file, data, size);
}
ssize_t read(int file, void* data, size_t size) {
  note("read");
  static constinit std::atomic<ssize_t (*)(int, void*, size_t)> known{nullptr};
  const auto next = real(known, "read");
  return next(file, data, size);
}
/// std::atomic::wait and notify use it.
long syscall(long number, ...) noexcept {
  note("syscall");
  static constinit std::atomic<long (*)(long, ...)> known{nullptr};
  const auto next = real(known, "syscall");
  va_list list;
  va_start(list, number);
  long a[6];
  for (long& argument : a) argument = va_arg(list, long);
  va_end(list);
  return next(number, a[0], a[1], a[2], a[3], a[4], a[5]);
}
}

#endif
