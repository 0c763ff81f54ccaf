#include <windows.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <system_error>
#include <thread>
#include <utility>

#include "integration/app/piped_program.h"

namespace palpate::app {
namespace {

constexpr size_t kMostComplaints = 400;

void close_handle(HANDLE& handle) {
  if (handle) CloseHandle(std::exchange(handle, nullptr));
}

/// A word as Windows' programs read it out of their command line.
std::wstring quoted(const std::string& word) {
  std::wstring made = L"\"";
  size_t backslashes = 0;
  for (const wchar_t c : std::filesystem::path(word).wstring()) {
    // Before a quotation mark a backslash stands for another one.
    if (c == L'"') made.append(backslashes + 1, L'\\');
    backslashes = c == L'\\' ? backslashes + 1 : 0;
    made += c;
  }
  return made.append(backslashes, L'\\') + L"\" ";
}

/// Both ends of a pipe; the program gets `theirs`.
bool make_pipe(HANDLE& ours, HANDLE& theirs, bool we_write) {
  SECURITY_ATTRIBUTES inherited{sizeof inherited, nullptr, TRUE};
  if (!CreatePipe(we_write ? &theirs : &ours, we_write ? &ours : &theirs, &inherited, 1 << 20))
    return false;
  return SetHandleInformation(ours, HANDLE_FLAG_INHERIT, 0);
}

}  // namespace

struct PipedProgram::System {
  HANDLE program = nullptr;
  HANDLE input = nullptr;
  HANDLE errors = nullptr;
  std::string complaints;
  std::thread listener;  ///< until its end: its standard error must not fill up
};

PipedProgram::PipedProgram() : system_(std::make_unique<System>()) {}
PipedProgram::PipedProgram(PipedProgram&&) noexcept = default;

PipedProgram::~PipedProgram() {
  if (!system_) return;
  close_handle(system_->input);
  if (system_->program) TerminateProcess(system_->program, 1);
  if (system_->listener.joinable()) system_->listener.join();
  close_handle(system_->errors);
  close_handle(system_->program);
}

ProgramStart PipedProgram::start(const std::vector<std::string>& words, std::string& problem) {
  HANDLE its_input = nullptr, its_errors = nullptr;
  SECURITY_ATTRIBUTES inherited{sizeof inherited, nullptr, TRUE};
  HANDLE nowhere = CreateFileW(L"NUL", GENERIC_WRITE, FILE_SHARE_READ | FILE_SHARE_WRITE,
                               &inherited, OPEN_EXISTING, 0, nullptr);
  BOOL started = FALSE;
  PROCESS_INFORMATION made{};
  if (make_pipe(system_->input, its_input, true) && make_pipe(system_->errors, its_errors, false)) {
    STARTUPINFOW with{};
    with.cb = sizeof with;
    with.dwFlags = STARTF_USESTDHANDLES;
    with.hStdInput = its_input;
    with.hStdOutput = nowhere;
    with.hStdError = its_errors;
    std::wstring line;
    for (const std::string& word : words) line += quoted(word);
    // A group of its own: Ctrl-C is for this program, which ends the other one.
    started =
        CreateProcessW(nullptr, line.data(), nullptr, nullptr, TRUE,
                       CREATE_NEW_PROCESS_GROUP | CREATE_NO_WINDOW, nullptr, nullptr, &with, &made);
  }
  const DWORD error = GetLastError();
  close_handle(its_input);
  close_handle(its_errors);
  close_handle(nowhere);
  if (!started) {
    problem = std::system_category().message(int(error));
    return error == ERROR_FILE_NOT_FOUND || error == ERROR_PATH_NOT_FOUND ? ProgramStart::kNotThere
                                                                          : ProgramStart::kFailed;
  }
  CloseHandle(made.hThread);
  system_->program = made.hProcess;
  system_->listener = std::thread([system = system_.get()] {
    std::array<char, 400> text{};
    DWORD count = 0;
    while (ReadFile(system->errors, text.data(), text.size(), &count, nullptr) && count > 0)
      system->complaints.append(
          text.data(), std::min(size_t(count), kMostComplaints - system->complaints.size()));
  });
  return ProgramStart::kRuns;
}

bool PipedProgram::write(const void* bytes, size_t n) {
  const auto* from = static_cast<const char*>(bytes);
  while (n > 0) {
    DWORD sent = 0;
    const auto most = DWORD(std::min(n, size_t(1) << 20));
    if (!WriteFile(system_->input, from, most, &sent, nullptr)) return false;
    from += sent;
    n -= sent;
  }
  return true;
}

bool PipedProgram::finish() {
  if (!system_->program) return false;
  close_handle(system_->input);
  WaitForSingleObject(system_->program, INFINITE);
  system_->listener.join();
  DWORD code = 1;
  GetExitCodeProcess(system_->program, &code);
  close_handle(system_->program);
  return code == 0;
}

std::string PipedProgram::complaints() const {
  return system_->complaints;
}

}  // namespace palpate::app
