// Called programs: their output, and that they and the programs that they started end on request.
#include "tests/lab/report/child.h"
#include "tests/support/wait_for.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cerrno>
#include <chrono>
#include <fstream>
#include <sstream>
#include <thread>

namespace palpate::report {
namespace {

/// Whether a process still runs: one that has ended may be a zombie until its parent waits for it.
bool runs(int pid) {
  std::ifstream stat("/proc/" + std::to_string(pid) + "/stat");
  std::string number, name, state;
  return stat >> number >> name >> state && state != "Z" && state != "X";
}

class CallProgram : public testing::Test {
 protected:
  int call(const std::string& shell, const Patience& patience = {}) const {
    return call_program({"sh", "-c", shell}, out_, out_, patience);
  }
  /// Calls a shell that prints its own process id and that of a program which it starts, requests a
  /// stop after both were printed, and returns the result; pids: the two.
  int stop_once_started(const std::string& shell, std::vector<int>& pids,
                        double grace_s = Patience().grace_s) const {
    std::stop_source source;
    std::jthread asks([&] {
      wait_for([&] {
        std::istringstream said(text_of(out_));
        pids.clear();
        for (int pid = 0; said >> pid;) pids.push_back(pid);
        return pids.size() == 2 && text_of(out_).ends_with("\n");
      });
      source.request_stop();
    });
    return call(shell, {.stop = source.get_token(), .grace_s = grace_s});
  }

  ScratchFolder folder_;
  std::filesystem::path out_ = folder_.path() / "out";
};

TEST_F(CallProgram, KeepsWhatTheProgramSaysAndHowItEnded) {
  EXPECT_EQ(call("echo well; echo badly >&2"), 0);
  EXPECT_EQ(text_of(out_), "well\nbadly\n");
  EXPECT_EQ(call("exit 3"), -1);
  EXPECT_EQ(call("kill -9 $$"), -1);
}

TEST_F(CallProgram, SaysThatAProgramIsNotInstalled) {
  EXPECT_EQ(call_program({"no-such-program-anywhere"}, out_, out_), ENOENT);
}

TEST_F(CallProgram, EndsTheProgramAndWhatItStartedWhenAskedToStop) {
  std::vector<int> pids;
  EXPECT_EQ(stop_once_started("sleep 1000 & echo $$ $!; wait", pids), ECANCELED);
  ASSERT_EQ(pids.size(), 2U);
  for (const int pid : pids) EXPECT_TRUE(wait_for([&] { return !runs(pid); })) << pid;
}

TEST_F(CallProgram, EndsAlsoWhatDoesNotListen) {
  std::vector<int> pids;
  EXPECT_EQ(stop_once_started("trap '' TERM; sleep 1000 & echo $$ $!; wait", pids), ECANCELED);
  ASSERT_EQ(pids.size(), 2U);
  for (const int pid : pids) EXPECT_TRUE(wait_for([&] { return !runs(pid); })) << pid;
}

TEST_F(CallProgram, LetsWhatTheProgramStartedPutItsThingsAway) {
  std::vector<int> pids;
  // The first process ends at once; the one that it started prints a text after a while.
  const std::string shell =
      "sh -c 'trap \"sleep 0.2; echo farewell; exit\" TERM; echo $$; while :; do sleep 0.01; done' "
      "& "
      "echo $$; wait";
  EXPECT_EQ(stop_once_started(shell, pids, 60.0), ECANCELED);
  EXPECT_TRUE(text_of(out_).ends_with("farewell\n")) << text_of(out_);
}

TEST_F(CallProgram, EndsOneThatTakesTooLong) {
  EXPECT_EQ(call("exec sleep 1000", {{}, 0.05}), ETIMEDOUT);
}

TEST_F(CallProgram, DoesNotStartWaitingForOneThatIsStoppedBefore) {
  std::stop_source source;
  source.request_stop();
  EXPECT_EQ(call("exec sleep 1000", {source.get_token()}), ECANCELED);
}

TEST(ScratchFolder, GoesWithAllThatIsInIt) {
  std::filesystem::path path;
  {
    const ScratchFolder folder;
    path = folder.path();
    std::ofstream(path / "file") << "text";
    EXPECT_EQ(text_of(path / "file"), "text");
  }
  EXPECT_FALSE(std::filesystem::exists(path));
  EXPECT_EQ(text_of(path / "file"), "");
}

}  // namespace
}  // namespace palpate::report
