// Nothing that the program writes says who the patient is: all its outputs of a DICOM series whose
// files say it are searched, as they are and unpacked.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <zlib.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>

#include "compute/volume/phantom.h"
#include "integration/files/text.h"
#include "tests/app/program.h"
#include "tests/files/dicom/dicom_files.h"
#include "tests/openigtlink/wire.h"

namespace palpate::app {
namespace {

namespace fs = std::filesystem;
using files::TemporaryFolder;

/// Who the patient is, in the elements that scanners and archives write.
const files::DicomValues kIdentity = {{0x00080050, "SHACC81237"},           // accession number
                                      {0x00080080, "LOQuellbrunn Clinic"},  // institution
                                      {0x00080090, "PNOverbeck^Ludmilla"},  // referring physician
                                      {0x00081070, "PNPfefferkorn"},        // operator
                                      {0x00100010, "PNZyxwander^Quirin"},   // name
                                      {0x00100020, "LOPX47-11QQ"},          // number
                                      {0x00100030, "DA19430217"},           // birth date
                                      {0x00101000, "LOOTHER-9958"},         // other numbers
                                      {0x00101001, "PNVormals^Quirin"},     // other names
                                      {0x00101040, "LOEulengasse 17"},      // address
                                      {0x00102154, "SH0049-555-0166"},      // telephone
                                      {0x00104000, "LTKnows Dr. Zyxwander"},
                                      {0x0020000d, "UI1.2.826.0.1.47114711"},  // study
                                      {0x00200010, "SHSTUDY7741"}};
constexpr const char* kSecrets[] = {
    "acc81237",   "quellbrunn", "overbeck",   "ludmilla", "pfefferkorn", "zyxwander",
    "quirin",     "px47-11qq",  "19430217",   "vormals",  "1943-02-17",  "17.02.1943",
    "other-9958", "eulengasse", "0049-555-0", "47114711", "study7741",   "1943.02.17"};

std::string bytes_of(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// What a zlib (or gzip) stream holds, as far as it goes.
std::string unpacked(std::string_view packed, int window_bits) {
  z_stream stream = {};
  inflateInit2(&stream, window_bits);
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
  stream.avail_in = uInt(packed.size());
  std::string text, part(1 << 16, '\0');
  int state = Z_OK;
  while (state == Z_OK) {
    stream.next_out = reinterpret_cast<Bytef*>(part.data());
    stream.avail_out = uInt(part.size());
    state = inflate(&stream, Z_NO_FLUSH);
    text.append(part, 0, part.size() - stream.avail_out);
  }
  inflateEnd(&stream);
  return text;
}

/// Names of what says who the patient is, in bytes and in what is packed in them.
std::vector<std::string> secrets_in(const std::string& bytes) {
  std::vector<std::string> found;
  // Letters of 8 and of 16 bits.
  std::string wide = bytes;
  std::erase(wide, '\0');
  for (const std::string& text : {files::lowered(bytes), files::lowered(wide)})
    for (const char* secret : kSecrets)
      if (text.find(secret) != std::string::npos) found.emplace_back(secret);
  const auto add = [&](const std::vector<std::string>& more) {
    found.insert(found.end(), more.begin(), more.end());
  };
  constexpr std::string_view kGzip("\x1f\x8b\x08", 3), kPng("\x89PNG\r\n\x1a\n", 8);
  constexpr int kGzipWindow = 16 + MAX_WBITS;
  for (size_t at = 0; (at = bytes.find(kGzip, at)) != std::string::npos; ++at)
    add(secrets_in(unpacked(std::string_view(bytes).substr(at), kGzipWindow)));
  if (!bytes.starts_with(kPng)) return found;
  // Texts of a PNG may be packed: zTXt and iTXt after their keyword.
  for (size_t at = kPng.size(); at + 12 <= bytes.size();) {
    const auto byte = [&](size_t k) { return size_t(uint8_t(bytes[at + k])); };
    const size_t size = byte(0) << 24 | byte(1) << 16 | byte(2) << 8 | byte(3);
    const std::string kind = bytes.substr(at + 4, 4), chunk = bytes.substr(at + 8, size);
    if (kind == "zTXt" || kind == "iTXt")
      for (size_t from = 0; from < chunk.size(); ++from)
        if (chunk[from] == '\x78') add(secrets_in(unpacked(chunk.substr(from), MAX_WBITS)));
    at += 12 + size;
  }
  return found;
}

/// Three phases of a ball whose radius changes, one file per slice, in a series each or in one.
void write_phases(const fs::path& folder, bool series_each) {
  constexpr int kSize = 16, kPhases = 3;
  fs::create_directories(folder);
  for (int t = 0; t < kPhases; ++t)
    for (int k = 0; k < kSize; ++k) {
      files::DicomFile file;
      file.grid.size = glm::ivec3(kSize);
      file.grid.spacing_mm = glm::dvec3(3.0);
      file.slice = k;
      for (int j = 0; j < kSize; ++j)
        for (int i = 0; i < kSize; ++i) {
          const double r = std::hypot(i - 7.5, j - 7.5, k - 7.5);
          file.stored.push_back(int(1000.0 / (1.0 + std::exp(r - 4.0 - 0.7 * t))) +
                                (i * 7 + j) % 5);
        }
      file.instance = t * kSize + k + 1;
      file.more = kIdentity;
      // As people write it into the name of a series.
      file.more[files::kTagSeriesDescription] =
          fmt::format("LOThorax Zyxwander, PX47-11qq {}%", 30 * t);
      if (series_each) {
        file.series = fmt::format("1.2.3.{}", t + 1);
        file.series_number = t + 1;
      } else {
        file.more[files::kTagTemporalPosition] = "IS" + std::to_string(t + 1);
      }
      files::write_dicom(folder / fmt::format("{}_{}.dcm", t, k), file);
    }
}

/// The series, and what the program has said and written of it.
class Privacy : public ::testing::Test {
 protected:
  Privacy() {
    setenv("XDG_STATE_HOME", (outputs_ / "state").c_str(), 1);
    write_phases(series(), false);
    write_phases(phases(), true);
  }

  std::string series() const { return inputs_ / "one_series"; }
  std::string phases() const { return inputs_ / "a_series_each"; }
  std::string out(const std::string& name) const { return outputs_ / name; }

  /// Runs a command and searches what it says.
  void said(const std::vector<std::string>& arguments, bool can_be_used = true) {
    const Outcome outcome = run(arguments);
    // Whether a motion of such small images is trusted does not matter here.
    const bool used = outcome.exit_code == 0 || outcome.exit_code == 3 || outcome.exit_code == 4;
    EXPECT_EQ(used, can_be_used) << fmt::format("{}", fmt::join(arguments, " ")) << outcome.out
                                 << outcome.err;
    EXPECT_THAT(secrets_in(outcome.out + outcome.err), ::testing::IsEmpty())
        << fmt::format("{}", fmt::join(arguments, " "));
  }

  /// Searches all files that were written, and their names.
  void search_files() {
    size_t searched = 0;
    for (const auto& entry : fs::recursive_directory_iterator(outputs_.path())) {
      EXPECT_THAT(secrets_in(entry.path().string()), ::testing::IsEmpty());
      if (!entry.is_regular_file()) continue;
      ++searched;
      ++written_[entry.path().extension().string()];
      EXPECT_THAT(secrets_in(bytes_of(entry.path())), ::testing::IsEmpty()) << entry.path();
    }
    EXPECT_GT(searched, 0u);
  }

  TemporaryFolder inputs_, outputs_;
  std::map<std::string, int> written_;  ///< ending -> how many
};

TEST_F(Privacy, TheSearchFindsWhatIsHidden) {
  const std::string plain = "x" + std::string("Zyxwander") + "y";
  EXPECT_FALSE(secrets_in(plain).empty());
  EXPECT_FALSE(secrets_in(bytes_of(fs::path(series()) / "0_0.dcm")).empty());
  std::string wide;
  for (const char c : plain) wide += {c, '\0'};
  EXPECT_FALSE(secrets_in(wide).empty());
  const gzFile file = gzopen(out("packed.gz").c_str(), "wb");
  gzwrite(file, plain.data(), unsigned(plain.size()));
  gzclose(file);
  EXPECT_FALSE(secrets_in("header\n" + bytes_of(out("packed.gz"))).empty());
  std::string packed(100, '\0');
  uLongf size = packed.size();
  compress(reinterpret_cast<Bytef*>(packed.data()), &size,
           reinterpret_cast<const Bytef*>(plain.data()), plain.size());
  const std::string chunk = std::string("key\0\0", 5) + packed.substr(0, size);
  const std::string png = std::string("\x89PNG\r\n\x1a\n\0\0\0", 11) + char(chunk.size()) + "zTXt" +
                          chunk + std::string(4, '\0');
  EXPECT_FALSE(secrets_in(png).empty());
  EXPECT_TRUE(secrets_in("nothing").empty());
}

TEST_F(Privacy, WhatTheProgramSaysAndWritesNamesNoPatient) {
  NEEDS_DEVICE();
  said({"info", series()});
  said({"info", phases(), "--json"});
  said({"plan", phases()});
  // What can not be used is named, too: a slice is missing.
  fs::create_directories(inputs_ / "broken");
  for (const auto& entry : fs::directory_iterator(phases()))
    if (entry.path().filename() != "1_7.dcm")
      fs::copy_file(entry.path(), fs::path(inputs_ / "broken") / entry.path().filename());
  said({"info", inputs_ / "broken"}, false);
  // Fields, plain and packed, summary, pictures.
  said({"motion", series(), "-o", out("motion"), "--preset", "fast", "--format", "nii.gz",
        "--inverse", "--confidence", "--pictures", "--json"});
  said({"check", "--sequence", series(), out("motion")});
  said({"view", series(), "--fields", out("motion"), "--picture", out("view.png"), "--picture-size",
        "96"});
  // Ticks, recording, plot, tubes, black box.
  said({"feel",           phases(),         "--fields",  out("motion"),   "--device",
        "simulated",      "--headset",      "off",       "--seconds",     "0.5",
        "--csv",          out("ticks.csv"), "--picture", out("felt.png"), "--record",
        out("run.ticks"), "--black-box",    out("box"),  "--tubes",       out("felt.vtk")});
  // Scenes, with a sequence in each.
  std::ofstream(out("scene.x3d")) << fmt::format(
      "<X3D><Scene><VolumeData DEF='chest' dimensions='0.1 0.1 0.1'><PalpateSequenceTexture3D "
      "url='\"{}\"'/></VolumeData></Scene></X3D>",
      phases());
  said({"convert", out("scene.x3d"), out("scene.json")});
  said({"convert", out("scene.json"), out("again.x3d")});
  said({"info", out("motion")});
  search_files();
  for (const char* ending : {".nrrd", ".gz", ".json", ".png", ".csv", ".ticks", ".vtk", ".x3d"})
    EXPECT_GT(written_[ending], 0) << ending;
}

TEST_F(Privacy, OpenIgtLinkNamesNoPatient) {
  NEEDS_DEVICE();
  const uint16_t port = test::WireServer().port();
  Program program({"serve", series(), "--fps", "2", "--seconds", "600", "--port",
                   std::to_string(port), "--json"});
  ASSERT_TRUE(program.wait_for("\n"));
  const int client = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address = {};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  ASSERT_EQ(connect(client, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  std::string messages, part(1 << 16, '\0');
  pollfd polled{client, POLLIN, 0};
  // Several images, and the motion with them.
  while (messages.size() < 60'000 && poll(&polled, 1, 60'000) > 0) {
    const ssize_t got = recv(client, part.data(), part.size(), 0);
    if (got <= 0) break;
    messages.append(part, 0, size_t(got));
  }
  close(client);
  program.signal(SIGINT);
  const Outcome outcome = program.wait();
  EXPECT_GE(messages.size(), 60'000u);
  EXPECT_THAT(messages, ::testing::HasSubstr("IMAGE"));
  EXPECT_THAT(secrets_in(messages), ::testing::IsEmpty());
  EXPECT_THAT(secrets_in(outcome.out + outcome.err), ::testing::IsEmpty());
}

TEST_F(Privacy, ACohortsPageNamesNoPatient) {
  NEEDS_DEVICE();
  if (std::system("/usr/bin/python3 -c 'import snakemake' > /dev/null 2>&1") != 0)
    GTEST_SKIP() << "There is no Snakemake here.";
  std::ofstream(out("table.csv")) << "name,sequence\ncase_01," << phases() << "\n";
  const std::string command = fmt::format(
      "/usr/bin/python3 '{}/integration/cohort/palpate-cohort' '{}' --output '{}' --palpate '{}' "
      "--preset fast --no-pictures > '{}' 2>&1",
      PALPATE_SOURCE_DIR, out("table.csv"), out("cohort"), PALPATE_PROGRAM, out("said.txt"));
  EXPECT_EQ(std::system(command.c_str()), 0) << bytes_of(out("said.txt"));
  search_files();
  EXPECT_GT(written_[".html"], 0);
}

}  // namespace
}  // namespace palpate::app
