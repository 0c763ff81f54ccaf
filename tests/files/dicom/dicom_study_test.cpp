// Folders as scanners and archives write them: what belongs to one sequence, and in which order.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>

#include "integration/files/dicom/dicom_layout.h"
#include "integration/files/read_sequence.h"
#include "integration/files/read_volume.h"
#include "tests/files/dicom/dicom_files.h"
#include "tests/files/temporary_folder.h"
#include "tests/files/test_images.h"

namespace palpate::files {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::DoubleNear;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Pointwise;

constexpr int kColumns = 8, kRows = 6;
constexpr double kStepMm = 3.0;

constexpr unsigned kImageType = 0x00080008, kSopInstance = 0x00080018, kContentTime = 0x00080033,
                   kModality = 0x00080060, kScanOptions = 0x00180022, kEchoTime = 0x00180081,
                   kSpacingBetween = 0x00180088, kNominalInterval = 0x00181062,
                   kKernel = 0x00181210, kInstance = 0x00200013, kPosition = 0x00200032,
                   kMosaicTiles = 0x0019100a, kMosaicMaker = 0x00190010,
                   kSiemensHeader = 0x00291010, kTagSlope = 0x00281053;

Grid stack_grid(int slices, glm::ivec2 size = {kColumns, kRows}) {
  Grid grid;
  grid.size = {size.x, size.y, slices};
  grid.spacing_mm = {1.5, 1.5, kStepMm};
  grid.origin_mm = {-4.0, 7.0, 11.0};
  return grid;
}

/// Frame t has the values 100 t to 100 t + 9, so that the order shows in the values.
std::vector<int> tiled_values(int t, int z) {
  std::vector<int> stored;
  for (int v = 0; v < kColumns * kRows; ++v) stored.push_back(100 * t + (v + 3 * z) % 10);
  return stored;
}

/// A folder that is filled image by image.
class DicomStudy : public ::testing::Test {
 protected:
  using Edit = std::function<void(DicomFile&)>;

  /// Slice z of frame t.
  void image(int t, int z, const Edit& edit = {}, int slices = 4) {
    DicomFile file;
    file.grid = stack_grid(slices);
    file.slice = z;
    file.stored = tiled_values(t, z);
    file.more[kSopInstance] = fmt::format("UI1.2.9.{}", count_);
    if (edit) edit(file);
    // Names in no order that means anything.
    write_dicom(folder_ / fmt::format("{}_{}", count_ * 7 % 11, count_), file);
    ++count_;
  }

  /// A stack of slices for each t.
  void stacks(int frames, const std::function<void(DicomFile&, int t)>& edit, int slices = 4) {
    for (int t = 0; t < frames; ++t)
      for (int z = 0; z < slices; ++z)
        image(
            t, z, [&](DicomFile& file) { edit(file, t); }, slices);
  }

  /// One series per name, frame t of name t.
  void series(const std::vector<std::string>& names,
              const std::function<void(DicomFile&, int t)>& edit = {}) {
    stacks(int(names.size()), [&](DicomFile& file, int t) {
      file.series = fmt::format("1.2.3.{}", (t * 5) % 97 + 10);
      file.series_number = 3 + t;
      file.more[kTagSeriesDescription] = "LO" + names[size_t(t)];
      if (edit) edit(file, t);
    });
  }

  Result<SequenceReader> open(const std::string& series = {}) const {
    return SequenceReader::open({folder_.path().string() + (series.empty() ? "" : "#" + series)});
  }

  /// The frames t in the order in which they are read.
  std::vector<int> order(const std::string& series = {}) const {
    auto reader = open(series);
    EXPECT_TRUE(reader) << reader.error().message;
    std::vector<int> found;
    for (size_t k = 0; reader && k < reader->frame_count(); ++k) {
      const auto frame = reader->frame(k);
      EXPECT_TRUE(frame) << frame.error().message;
      if (!frame) return {};
      const auto [least, most] = std::minmax_element(frame->values.begin(), frame->values.end());
      EXPECT_EQ(int(*least) / 100, int(*most) / 100) << "a frame is made of two";
      found.push_back(int(*least) / 100);
    }
    return found;
  }

  std::string refusal(const std::string& series = {}) const {
    const auto reader = open(series);
    EXPECT_FALSE(reader);
    return reader ? std::string() : reader.error().message;
  }

  std::vector<std::string> notes() const {
    const auto reader = open();
    EXPECT_TRUE(reader) << reader.error().message;
    return reader ? reader->notes() : std::vector<std::string>();
  }

  void clear() {
    for (const auto& entry : std::filesystem::directory_iterator(folder_.path()))
      std::filesystem::remove_all(entry.path());
    count_ = 0;
  }

  TemporaryFolder folder_;
  int count_ = 0;
};

std::vector<int> up_to(int count) {
  std::vector<int> rising(size_t(count), 0);
  for (int t = 0; t < count; ++t) rising[size_t(t)] = t;
  return rising;
}

// F2, F3: phases that are series ------------------------------------------------------------------

TEST_F(DicomStudy, LeavesOutWhatIsNoPhase) {
  for (const auto& extra :
       std::vector<std::vector<std::string>>{{"Thorax AvgIP", "Thorax MIP"},
                                             {"Average 0-100%"},
                                             {"Thorax Untagged", "Thorax Free breathing"},
                                             {"MinIP", "AIP", "Thorax ITV"},
                                             {"Thorax 0-90%"},
                                             {"Thorax MIP 0-90%"}}) {
    std::vector<std::string> names = {"Thorax 0%", "Thorax 25%", "Thorax 50%", "Thorax 75%"};
    names.insert(names.end(), extra.begin(), extra.end());
    series(names, [](DicomFile& file, int t) {
      file.more[kImageType] = t < 4 ? "CSORIGINAL\\PRIMARY\\AXIAL" : "CSDERIVED\\SECONDARY\\AXIAL";
    });
    EXPECT_EQ(order(), up_to(4)) << extra.front();
    EXPECT_THAT(notes(), Contains(AllOf(HasSubstr("left out"), HasSubstr(extra.front()))));
    clear();
  }
}

TEST_F(DicomStudy, LeavesOutADerivedSeriesOfAPhasesName) {
  series({"Thorax 0%", "Thorax 25%", "Thorax 50%", "Thorax 75%", "Thorax 100%"}, [](DicomFile& file,
                                                                                    int t) {
    file.more[kImageType] = t < 4 ? "CSORIGINAL\\PRIMARY\\AXIAL" : "CSDERIVED\\SECONDARY\\AVERAGE";
  });
  EXPECT_EQ(order(), up_to(4));
  EXPECT_THAT(notes(), Contains(HasSubstr("Thorax 100%")));
}

TEST_F(DicomStudy, OrdersPhasesAsTheBreathHasThem) {
  const std::vector<std::vector<std::string>> cases = {
      {"0% Ex", "25% In", "50% In", "75% In", "100% In", "75% Ex", "50% Ex", "25% Ex"},
      {"0% In", "25% In", "50% In", "100% Ex", "50% Ex", "25% Ex"},
      {"Lung In 0 %", "Lung In 50 %", "Lung In 100 %", "Lung Ex. 60 %", "Lung Ex 20 %"},
      {"CT 0% Inhale", "CT 100% Inhale", "CT 50% Exhale"},
      {"0%", "50% Insp", "100%", "50% Exp"},
      {"Gated, 0.0%A", "Gated, 5.0%A", "Gated, 10.0%A", "Gated, 90.0%A"},
      {"CTP0", "CTP2", "CTP10", "CTP20"},
      {"T=0%", "T=10%", "T=90%", "T=100%"},
      {"Phase 1", "Phase 2", "Phase 10", "Phase 11"},
      {"Heart -400 ms", "Heart -350 ms", "Heart 0 ms", "Heart 50 ms"},
      {"4D 3.0 B30f 0%", "4D 3.0 B30f 30%", "4D 3.0 B30f 70%"}};
  for (const auto& names : cases) {
    // Reconstructed in another order: the numbers of series mean nothing beside a phase.
    series(names, [](DicomFile& file, int t) { file.series_number = 40 - 3 * t; });
    EXPECT_EQ(order(), up_to(int(names.size()))) << names.front();
    clear();
  }
}

TEST_F(DicomStudy, RefusesPhasesThatAreThereTwice) {
  series({"A 0%", "A 50%", "A 50%", "A 100%"});
  EXPECT_THAT(refusal(), HasSubstr("several of one phase"));
}

TEST_F(DicomStudy, TakesSeriesWithoutNamesInTheOrderOfTheirNumbers) {
  series({"Thorax", "Thorax", "Thorax"});
  EXPECT_EQ(order(), up_to(3));
  EXPECT_THAT(notes(), Contains(HasSubstr("ordered by the series number")));
}

TEST_F(DicomStudy, InAFolderPerFrameIsOrderedByTheFoldersIfNothingContradictsThem) {
  for (const bool agree : {true, false}) {
    int n = 0;
    for (const char* phase : {"phase_2", "phase_5", "phase_10"}) {
      std::filesystem::create_directories(folder_ / phase);
      for (int z = 0; z < 4; ++z) {
        DicomFile file;
        file.grid = stack_grid(4);
        file.slice = z;
        file.stored = tiled_values(n, z);
        file.series = fmt::format("1.2.3.{}", 50 - n);
        // Reconstructed together, under one number; or in another order.
        file.series_number = agree ? 7 : 9 - n;
        write_dicom(folder_ / fmt::format("{}/{}", phase, z), file);
      }
      ++n;
    }
    if (agree)
      EXPECT_EQ(order(), up_to(3));
    else
      EXPECT_THAT(refusal(), AllOf(HasSubstr("folders' names"), HasSubstr("series number")));
    clear();
  }
}

TEST_F(DicomStudy, MayPassMidnightWithoutADate) {
  const char* const times[] = {"TM235930", "TM235950", "TM000010", "TM000030"};
  for (const unsigned tag : {kTagAcquisitionTime, kContentTime}) {
    stacks(4, [&](DicomFile& file, int t) {
      file.instance = 1;
      file.more[tag] = times[t];
    });
    EXPECT_EQ(order(), up_to(4));
    EXPECT_THAT(open()->times_s(), Pointwise(DoubleNear(1e-9), {0.0, 20.0, 40.0, 60.0}));
    clear();
  }
}

TEST_F(DicomStudy, OfOneSeriesNumberIsOrderedByTheTimeOfItsImages) {
  // Classic export of newer scanners: a UID per frame, one number and name.
  series({"perf", "perf", "perf", "perf"}, [](DicomFile& file, int t) {
    file.series_number = 12;
    file.more[kTagAcquisitionTime] = fmt::format("TM10000{}", 2 * t);
  });
  EXPECT_EQ(order(), up_to(4));
}

// F4: kinds ---------------------------------------------------------------------------------------

TEST_F(DicomStudy, TakesTheMagnitudeAndSaysSo) {
  const std::vector<std::function<void(DicomFile&, int)>> tags = {
      [](DicomFile& file, int n) { file.more[kTagAcquisitionNumber] = fmt::format("IS{}", n); },
      [](DicomFile& file, int n) {
        file.more[kTagTriggerTime] = fmt::format("DS{}", 40 * (n / 2));
      },
      [](DicomFile& file, int n) { file.instance = n + 1; }};
  for (const auto& [m, p] : std::vector<std::pair<const char*, const char*>>{
           {"CSORIGINAL\\PRIMARY\\M\\FFE", "CSORIGINAL\\PRIMARY\\P\\FFE"},
           {"CSORIGINAL\\PRIMARY\\M_FFE", "CSORIGINAL\\PRIMARY\\VELOCITY MAP"},
           {"CSDERIVED\\PRIMARY\\MAG", "CSDERIVED\\PRIMARY\\PHASE MAP"}}) {
    for (const auto& tag : tags) {
      for (int n = 0; n < 8; ++n)
        for (int z = 0; z < 4; ++z)
          image(n / 2 + 20 * (n % 2), z, [&](DicomFile& file) {
            file.instance = 1;
            tag(file, n);
            file.more[kImageType] = n % 2 == 0 ? m : p;
          });
      EXPECT_EQ(order(), up_to(4)) << m;
      EXPECT_THAT(notes(), Contains(HasSubstr("left out")));
      clear();
    }
  }
}

TEST_F(DicomStudy, RefusesImagesOfAnotherKindAndNamesWhatDiffers) {
  struct Kind {
    unsigned tag;
    std::vector<std::string> values;
    const char* name;
  };
  for (const Kind& kind :
       {Kind{kEchoTime, {"DS4.9", "DS7.4"}, "echo time"},
        Kind{0x00180082, {"DS100", "DS300", "DS700"}, "inversion time"},
        Kind{0x00181314, {"DS5", "DS15"}, "flip angle"},
        Kind{kKernel, {"SHB30f", "SHB60f"}, "kernel"},
        Kind{0x00180060, {"DS80", "DS140"}, "tube voltage"},
        Kind{0x00189087, {"FD0", "FD1000"}, "b-value"},
        Kind{0x00180024, {"SHfl3d1_v150in", "SHfl3d1_v150ap"}, "sequence name"},
        Kind{0x00281051, {"", ""}, nullptr},
        Kind{0x00541101, {"LOmeasured", "LOnone"}, "corrections"},
        Kind{kImageType, {"CSDERIVED\\PRIMARY\\W", "CSDERIVED\\PRIMARY\\F"}, "image type"}}) {
    if (kind.name == nullptr) continue;
    for (const bool are_series : {false, true}) {
      stacks(int(kind.values.size()), [&](DicomFile& file, int t) {
        if (are_series) file.series = fmt::format("1.2.3.{}", t + 1);
        if (are_series) file.series_number = t + 1;
        file.instance = t + 1;
        file.more[kind.tag] = kind.values[size_t(t)];
        file.more[kTagTemporalPosition] = fmt::format("IS{}", t + 1);
        file.more[kTagAcquisitionTime] = fmt::format("TM10000{}", t);
      });
      EXPECT_THAT(refusal(), AllOf(HasSubstr("no frames of one sequence"), HasSubstr(kind.name)))
          << kind.name;
      clear();
    }
  }
}

TEST_F(DicomStudy, RefusesSeriesWhoseNamesAreNoPhases) {
  for (const auto& names : std::vector<std::vector<std::string>>{{"water", "fat"},
                                                                 {"T1", "T2"},
                                                                 {"T1 tra", "T2 tra"},
                                                                 {"rest", "stress"},
                                                                 {"echo 1", "echo 2"},
                                                                 {"b0", "b500", "b1000"},
                                                                 {"mono 40 keV", "mono 70 keV"},
                                                                 {"Chest 1 mm", "Chest 5 mm"}}) {
    series(names);
    EXPECT_THAT(refusal(), HasSubstr("no frames of one sequence")) << names.front();
    EXPECT_EQ(order("3"), std::vector<int>{0});
    EXPECT_EQ(order(names.back()), std::vector<int>{int(names.size()) - 1});
    // A person may know better.
    EXPECT_EQ(order("4,3"), (std::vector<int>{1, 0}));
    clear();
  }
}

TEST_F(DicomStudy, IsToBeChosenFromWhereTwoSequencesLieInIt) {
  for (const char* second : {"rest", "task"}) {
    for (int s = 0; s < 2; ++s)
      stacks(4, [&](DicomFile& file, int t) {
        for (int& value : file.stored) value += 1000 * s;
        file.series = fmt::format("1.2.3.{}", s + 1);
        file.series_number = s + 1;
        file.more[kTagSeriesDescription] = s == 0 ? "LOrest" : std::string("LO") + second;
        file.more[kTagAcquisitionNumber] = fmt::format("IS{}", t + 1);
        file.more[kTagAcquisitionTime] = fmt::format("TM10{:02}0{}", 5 * s, t);
      });
    EXPECT_THAT(refusal(),
                AllOf(HasSubstr("holds 2 sequences"), HasSubstr("4 frames of 8 x 6 x 4")));
    EXPECT_EQ(order("1"), up_to(4));
    EXPECT_EQ(order("2"), (std::vector<int>{10, 11, 12, 13}));
    EXPECT_THAT(refusal("7"), HasSubstr("holds no series '7'"));
    clear();
  }
}

TEST_F(DicomStudy, OfTwoPatientsIsNoSequence) {
  series({"Thorax 0%", "Thorax 50%"},
         [](DicomFile& file, int t) { file.more[0x00100020] = t == 0 ? "LOQX7731" : "LOQX7732"; });
  // Whose they are is compared, and never shown.
  EXPECT_THAT(refusal(), AllOf(HasSubstr("no frames of one sequence"), Not(HasSubstr("QX77"))));
}

TEST_F(DicomStudy, OpensAStudyWithOneSequenceInIt) {
  stacks(3, [](DicomFile& file, int t) {
    file.series = "1.2.3.5";
    file.series_number = 5;
    file.more[kTagSeriesDescription] = "LOcine";
    file.more[kTagTriggerTime] = fmt::format("DS{}", 40 * t);
  });
  stacks(
      1,
      [](DicomFile& file, int) {
        file.series = "1.2.3.1";
        file.more[kTagSeriesDescription] = "LOlocaliser";
        file.more[kImageType] = "CSORIGINAL\\PRIMARY\\LOCALIZER";
      },
      2);
  EXPECT_EQ(order(), up_to(3));
  EXPECT_THAT(notes(), Contains(AllOf(HasSubstr("'cine' is read"), HasSubstr("localiser"))));
}

// F5: mosaics -------------------------------------------------------------------------------------

/// Siemens' own header with the number of tiles and the direction from slice to slice.
std::string siemens_header(int tiles, double normal_z) {
  std::string bytes = std::string("SV10\4\3\2\1", 8);
  const auto number = [&](uint32_t value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
  };
  const std::vector<std::pair<std::string, std::vector<std::string>>> elements = {
      {"EchoLinePosition", {"32"}},
      {"NumberOfImagesInMosaic", {std::to_string(tiles)}},
      {"SliceNormalVector", {"0.0", "0.0", fmt::format("{:.8f}", normal_z)}}};
  number(uint32_t(elements.size()));
  number(77);
  for (const auto& [name, values] : elements) {
    std::string padded = name;
    padded.resize(64, '\0');
    bytes += padded;
    number(uint32_t(values.size()));
    bytes += std::string("IS\0\0", 4);
    number(6);
    number(uint32_t(values.size()));
    number(77);
    for (const std::string& value : values) {
      const auto length = uint32_t(value.size() + 1);
      for (const uint32_t n : {length, length, uint32_t(77), length}) number(n);
      std::string item = value;
      item.resize((length + 3) / 4 * 4, '\0');
      bytes += item;
    }
  }
  return bytes;
}

TEST_F(DicomStudy, UnfoldsMosaics) {
  // 5 slices on 3 x 3 tiles.
  for (const bool has_header : {false, true}) {
    for (int t = 0; t < 3; ++t) {
      DicomFile file;
      file.grid = stack_grid(1, {3 * kColumns, 3 * kRows});
      file.stored.assign(size_t(9 * kColumns * kRows), 0);
      for (int z = 0; z < 5; ++z)
        for (int v = 0; v < kColumns * kRows; ++v) {
          const int column = z % 3 * kColumns + v % kColumns, row = z / 3 * kRows + v / kColumns;
          file.stored[size_t(row * 3 * kColumns + column)] = tiled_values(t, z)[size_t(v)];
        }
      file.more = {{kImageType, "CSORIGINAL\\PRIMARY\\M\\ND\\MOSAIC"},
                   {kTagAcquisitionNumber, fmt::format("IS{}", t + 1)},
                   {kSpacingBetween, "DS3.3"}};
      if (has_header)
        file.more[kSiemensHeader] = "OB" + siemens_header(5, -1.0);
      else
        file.more[kMosaicTiles] = "US5", file.more[kMosaicMaker] = "LOSIEMENS MR HEADER";
      write_dicom(folder_ / std::to_string(t), file);
    }
    auto reader = open();
    ASSERT_TRUE(reader) << reader.error().message;
    EXPECT_EQ(reader->frame_count(), 3U);
    const Grid grid = reader->grid();
    EXPECT_EQ(grid.size, glm::ivec3(kColumns, kRows, 5));
    EXPECT_NEAR(grid.spacing_mm.z, 3.3, 1e-6);
    const auto frame = reader->frame(1);
    ASSERT_TRUE(frame);
    const size_t n = size_t(kColumns * kRows);
    for (int z = 0; z < 5; ++z) {
      // The header says that slices follow against the normal of rows and columns.
      const size_t at = size_t(has_header ? 4 - z : z);
      const std::vector<int> wanted = tiled_values(1, z);
      EXPECT_TRUE(std::equal(wanted.begin(), wanted.end(), frame->values.begin() + long(at * n)))
          << z;
      // The position is that of the whole picture's corner, as if it were one slice.
      const glm::dvec3 corner = grid.lps_from_index({0, 0, double(at)});
      const glm::dvec3 whole = stack_grid(1).origin_mm;
      EXPECT_NEAR(corner.x, whole.x + 1.5 * kColumns, 1e-6);
      EXPECT_NEAR(corner.y, whole.y + 1.5 * kRows, 1e-6);
      EXPECT_NEAR(corner.z, whole.z + (has_header ? -3.3 : 3.3) * z, 1e-6);
    }
    clear();
  }
}

TEST_F(DicomStudy, RefusesMosaicsThatDoNotSayHowManySlicesTheyHold) {
  for (const char* type : {"CSORIGINAL\\PRIMARY\\M\\MOSAIC", "CSORIGINAL\\PRIMARY\\VFRAME"}) {
    image(0, 0, [&](DicomFile& file) { file.more[kImageType] = type; });
    EXPECT_THAT(refusal(), AllOf(HasSubstr("mosaic"), HasSubstr("dcm2niix")));
    clear();
  }
}

// F6: the last keys, and keys that contradict each other ------------------------------------------

TEST_F(DicomStudy, IsOrderedByTheLastKeysIfNoOtherIsThere) {
  const std::vector<std::pair<const char*, std::function<void(DicomFile&, int)>>> keys = {
      {"content time",
       [](DicomFile& file, int t) { file.more[kContentTime] = fmt::format("TM10000{}.5", t); }},
      {"instance number", [](DicomFile& file, int t) { file.instance = 4 * t + file.slice + 1; }},
      {"instance number", [](DicomFile& file, int t) { file.instance = 5 * file.slice + t + 1; }},
      {"scan options",
       [](DicomFile& file, int t) { file.more[kScanOptions] = fmt::format("CSTP{}PC", 20 * t); }}};
  for (const auto& [name, edit] : keys) {
    stacks(5, edit);
    EXPECT_EQ(order(), up_to(5)) << name;
    EXPECT_THAT(open()->ordered_by(), HasSubstr(name));
    clear();
  }
  // Numbers that count in no order are none.
  stacks(5, [](DicomFile& file, int t) {
    file.instance = (t * 7 + file.slice * file.slice * 3) % 23;
  });
  EXPECT_THAT(refusal(), HasSubstr("tells them apart"));
}

TEST_F(DicomStudy, IsRefusedWhereTwoKeysContradictEachOther) {
  const auto position = [](DicomFile& file, int t) {
    file.more[kTagTemporalPosition] = fmt::format("IS{}", t + 1);
  };
  const auto trigger = [](DicomFile& file, double ms) {
    file.more[kTagTriggerTime] = fmt::format("DS{}", ms);
  };
  const int shuffled[] = {0, 3, 1, 4, 2};
  const std::vector<std::pair<const char*, std::function<void(DicomFile&, int)>>> cases = {
      {"trigger time",
       [&](DicomFile& file, int t) { position(file, t), trigger(file, 100.0 * shuffled[t]); }},
      {"phase (0020,9241)",
       [&](DicomFile& file, int t) {
         position(file, t);
         file.more[kTagCardiacPhase] = fmt::format("FL{}", 90 - 20 * t);
       }},
      {"acquisition time",
       [](DicomFile& file, int t) {
         file.more[kTagAcquisitionNumber] = fmt::format("IS{}", t + 1);
         file.more[kTagAcquisitionTime] = fmt::format("TM1000{:02}", 30 - t);
       }},
      // The maker's clock instead of a trigger: the scan takes a minute.
      {"acquisition time",
       [&](DicomFile& file, int t) {
         trigger(file, 10000.0 * shuffled[t]);
         file.more[kTagAcquisitionTime] = fmt::format("TM1000{:02}", 10 * t);
       }},
      {"instance number", [](DicomFile& file, int t) {
         file.instance = 5 * file.slice + std::vector<int>{1, 4, 2, 5, 3}[size_t(t)];
         file.more[kContentTime] = fmt::format("TM10000{}", t);
       }}};
  for (const auto& [name, edit] : cases) {
    stacks(5, [&](DicomFile& file, int t) {
      file.instance = 1;
      edit(file, t);
    });
    EXPECT_THAT(refusal(), AllOf(HasSubstr("in one order by"), HasSubstr(name))) << name;
    clear();
  }
}

TEST_F(DicomStudy, MayBeAcquiredInAnotherOrderWhereTheHeartSteersIt) {
  stacks(5, [](DicomFile& file, int t) {
    file.more[kTagTriggerTime] = fmt::format("DS{}", 40 * t);
    file.more[kTagAcquisitionTime] = fmt::format("TM1000{:02}", 10 * ((t * 3) % 5));
    file.more[kNominalInterval] = "IS900";
  });
  EXPECT_EQ(order(), up_to(5));
}

TEST_F(DicomStudy, MayBeginItsCycleWithAnotherFrame) {
  stacks(5, [](DicomFile& file, int t) {
    file.more[kTagTemporalPosition] = fmt::format("IS{}", t + 1);
    file.more[kTagTriggerTime] = fmt::format("DS{}", 100 * ((t + 3) % 5));
  });
  EXPECT_EQ(order(), up_to(5));
  EXPECT_THAT(notes(), Contains(HasSubstr("the cycle begins with another frame")));
}

TEST_F(DicomStudy, IsRefusedWhereAFrameLacksASliceAndAnotherHasItTwice) {
  // The numbers of images agree, their frames do not.
  for (int t = 0; t < 4; ++t)
    for (int z = 0; z < 4; ++z)
      image(t, z, [&](DicomFile& file) {
        const int told = z == 2 && t == 3 ? 4 : t;
        file.more[kTagTemporalPosition] = fmt::format("IS{}", told + (z == 2 && t > 0 ? 1 : 0));
      });
  EXPECT_THAT(refusal(), HasSubstr("none of slice"));
}

TEST_F(DicomStudy, ThatWasStoppedLosesItsLastFrameOnly) {
  for (const unsigned tag : {kTagTemporalPosition, kTagAcquisitionNumber}) {
    for (const bool is_gated : {false, true}) {
      for (int t = 0; t < 4; ++t)
        for (int z = 0; z < (t < 3 ? 4 : 2); ++z)
          image(t, z, [&](DicomFile& file) {
            file.more[tag] = fmt::format("IS{}", t + 1);
            if (is_gated) file.more[kNominalInterval] = "IS900";
          });
      if (is_gated) {
        EXPECT_THAT(refusal(), HasSubstr("of the others"));
      } else {
        EXPECT_EQ(order(), up_to(3));
        EXPECT_THAT(notes(), Contains(HasSubstr("it has 2 of 4 slices")));
      }
      clear();
    }
  }
}

TEST_F(DicomStudy, OfRepetitionsAndPhasesIsNoSequence) {
  stacks(6, [](DicomFile& file, int t) {
    file.more[kTagTriggerTime] = fmt::format("DS{}", 100 * (t % 3));
    file.more[kTagAcquisitionNumber] = fmt::format("IS{}", t + 1);
  });
  EXPECT_THAT(refusal(), HasSubstr("tells only some of them apart"));
}

// F7, F8: places ----------------------------------------------------------------------------------

TEST_F(DicomStudy, HasPositionsAsExactAsTheirTextSays) {
  struct Text {
    double step_mm;
    int decimals;
  };
  for (const Text text :
       {Text{0.625, 2}, Text{0.8333, 2}, Text{1.25, 1}, Text{3.15, 1}, Text{0.33, 2},
        Text{0.488281, 3}, Text{7.0, 0}, Text{3.3, 0}, Text{2.7344, 2}}) {
    const auto write = [&](int lost) {
      for (int t = 0; t < 2; ++t)
        for (int z = 0; z < 16; ++z)
          if (z != lost)
            image(t, z, [&](DicomFile& file) {
              file.more[kTagTemporalPosition] = fmt::format("IS{}", t + 1);
              file.more[kPosition] =
                  fmt::format("DS-4\\7\\{:.{}f}", -20.0 + text.step_mm * z, text.decimals);
            });
    };
    write(-1);
    const auto reader = open();
    ASSERT_TRUE(reader) << text.step_mm << reader.error().message;
    EXPECT_EQ(reader->frame_count(), 2U);
    EXPECT_NEAR(reader->grid().spacing_mm.z, text.step_mm,
                std::max(0.003 * text.step_mm, 0.05 * std::pow(10.0, -text.decimals)));
    clear();
    write(7);
    EXPECT_THAT(refusal(), HasSubstr("unevenly spaced")) << text.step_mm;
    clear();
  }
}

TEST_F(DicomStudy, RefusesASpacingThatChangesAlongTheStack) {
  for (int z = 0; z < 40; ++z)
    image(
        0, z,
        [&](DicomFile& file) {
          file.more[kPosition] = fmt::format("DS-4\\7\\{:.1f}", z < 20 ? z : 20 + 1.1 * (z - 20));
        },
        40);
  EXPECT_THAT(refusal(), HasSubstr("along the stack"));
}

TEST_F(DicomStudy, KeepsSlicesApartBesideAGreatGap) {
  // A real export: one slice of a range, and three of another.
  const double heights[] = {-99.480003, 103.019997, 104.269997, 105.519997};
  for (int z = 0; z < 4; ++z)
    image(0, z, [&](DicomFile& file) {
      file.more[kPosition] = fmt::format("DS-4\\7\\{:.6f}", heights[z]);
    });
  EXPECT_THAT(refusal(), HasSubstr("unevenly spaced"));
}

TEST_F(DicomStudy, OfPicturesWithOneNameIsNoSequence) {
  // Localisers, planned anew.
  stacks(
      2,
      [](DicomFile& file, int t) {
        file.series = fmt::format("1.2.3.{}", t + 1);
        file.series_number = t + 1;
        file.more[kTagSeriesDescription] = "LOFAST LOCALIZER";
      },
      1);
  EXPECT_THAT(refusal(), HasSubstr("no frames of one sequence"));
}

TEST_F(DicomStudy, MayHavePlacesThatDifferByMicrometresFromFrameToFrame) {
  for (const double um : {0.5, 2.0, 10.0, 50.0}) {
    stacks(3, [&](DicomFile& file, int t) {
      file.more[kTagTemporalPosition] = fmt::format("IS{}", t + 1);
      file.more[kPosition] = fmt::format("DS-4\\7\\{:.4f}", 3.0 * file.slice + 1e-3 * um * (t % 2));
    });
    EXPECT_EQ(order(), up_to(3)) << um;
    clear();
  }
  // Frames that lie beside each other are of two scans.
  stacks(2, [&](DicomFile& file, int t) {
    file.more[kTagTemporalPosition] = fmt::format("IS{}", t + 1);
    file.more[kPosition] = fmt::format("DS{}\\7\\{}", -4 + t, 3 * file.slice);
  });
  EXPECT_THAT(refusal(), HasSubstr("lie 1 mm apart"));
}

// F13, F14: what else lies in a folder, and stacks of slices --------------------------------------

TEST_F(DicomStudy, LeavesForeignFilesOutAndSaysSo) {
  const std::vector<std::pair<const char*, DicomValues>> foreign = {
      {"dose", {{kModality, "CSRTDOSE"}, {kTagNumberOfFrames, "IS3"}}},
      {"multi-frame", {{kTagNumberOfFrames, "IS3"}}},
      {"segmentation", {{kModality, "CSSEG"}}},
      {"colour", {{0x00280002, "US3"}}},
      {"numbered colours", {{0x00280004, "CSPALETTE COLOR"}}},
      {"where its slice lies", {{kPosition, ""}}}};
  for (const auto& [what, values] : foreign) {
    stacks(3, [](DicomFile& file, int t) {
      file.more[kTagTemporalPosition] = fmt::format("IS{}", t + 1);
    });
    image(9, 0, [&, more = values](DicomFile& file) {
      file.series = "1.2.3.99";
      for (const auto& [tag, value] : more) file.more[tag] = value;
    });
    EXPECT_EQ(order(), up_to(3)) << what;
    EXPECT_THAT(notes(), Contains(AllOf(HasSubstr("left out"), HasSubstr(what))));
    clear();
  }
}

void one_series_per_slice(DicomFile& file, int t) {
  file.series = fmt::format("1.2.3.{}", file.slice + 1);
  file.series_number = file.slice + 1;
  file.more[kTagTriggerTime] = fmt::format("DS{}", 40 * t + file.slice);
}

TEST_F(DicomStudy, MayBeAStackOfSeriesWithASliceEach) {
  for (const auto& names :
       std::vector<std::vector<std::string>>{{"sax", "sax", "sax", "sax"},
                                             {"sax 1", "sax 2", "sax 3", "sax 4"},
                                             {"base", "mid", "low", "apex"}}) {
    stacks(6, [&](DicomFile& file, int t) {
      one_series_per_slice(file, t);
      file.more[kTagSeriesDescription] = "LO" + names[size_t(file.slice)];
    });
    EXPECT_EQ(order(), up_to(6)) << names[1];
    EXPECT_EQ(open()->grid().size.z, 4);
    clear();
  }
}

TEST_F(DicomStudy, NamesTheCauseWhereAStackDoesNotFit) {
  stacks(6, one_series_per_slice);
  image(6, 2, [](DicomFile& file) { one_series_per_slice(file, 6); });
  EXPECT_THAT(refusal(), HasSubstr("holds 7 images of slice 2"));
  clear();
  const auto repeated = [](DicomFile& file, int t) {
    one_series_per_slice(file, t % 6);
    if (t >= 6) file.series = "1.2.3.40", file.series_number = 40;
  };
  stacks(6, one_series_per_slice);
  for (int t = 6; t < 12; ++t) image(t, 1, [&](DicomFile& file) { repeated(file, t); });
  EXPECT_THAT(refusal(), AllOf(HasSubstr("acquired 2 times"), HasSubstr("2, 40")));
  clear();
  stacks(6, [](DicomFile& file, int t) {
    one_series_per_slice(file, t);
    file.more[kPosition] = fmt::format("DS{}\\7\\{}", file.slice % 2 ? 0.3 : 0.0, 3 * file.slice);
  });
  EXPECT_THAT(refusal(), AllOf(HasSubstr("breath-holds"), Not(HasSubstr("gantry"))));
}

TEST_F(DicomStudy, WithEveryImageTwiceIsReadOnce) {
  stacks(3, [](DicomFile& file, int t) {
    file.more[kTagTemporalPosition] = fmt::format("IS{}", t + 1);
  });
  std::filesystem::create_directory(folder_ / "copy");
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder_.path()))
    if (entry.is_regular_file()) files.push_back(entry.path());
  for (const auto& file : files)
    std::filesystem::copy_file(file, folder_ / ("copy/" + file.filename().string()));
  EXPECT_EQ(order(), up_to(3));
  EXPECT_THAT(notes(), Contains(HasSubstr("holds 12 images twice")));
  clear();
  // An anonymiser's one name for all makes no copies.
  stacks(3, [](DicomFile& file, int t) {
    file.more[kTagTemporalPosition] = fmt::format("IS{}", t + 1);
    file.more[kSopInstance] = "UI1.2.3.4.5";
  });
  EXPECT_EQ(order(), up_to(3));
}

// F17: details ------------------------------------------------------------------------------------

TEST_F(DicomStudy, ReadsASlopeOfZeroAsNone) {
  image(
      3, 0, [](DicomFile& file) { file.more[kTagSlope] = "DS0"; }, 1);
  EXPECT_EQ(order(), std::vector<int>{3});
}

TEST_F(DicomStudy, ReadsRealPixels) {
  image(
      0, 0,
      [](DicomFile& file) {
        file.more[0x00280100] = "US32";
        file.more[0x00280101] = "US32";
        std::string values;
        for (int v = 0; v < kColumns * kRows; ++v) {
          const float value = 0.25F * float(v) - 3.5F;
          values.append(reinterpret_cast<const char*>(&value), sizeof(value));
        }
        file.more[0x7fe00008] = "OF" + values;
      },
      1);
  const auto volume = read_volume(folder_.path());
  ASSERT_TRUE(volume) << volume.error().message;
  for (int v = 0; v < kColumns * kRows; ++v)
    EXPECT_EQ(volume->values[size_t(v)], 0.25F * float(v) - 3.5F);
}

TEST_F(DicomStudy, ReadsFilesWithoutAPreamble) {
  for (const bool has_meta : {true, false}) {
    for (const DicomSyntax syntax : {DicomSyntax::kExplicitLittle, DicomSyntax::kImplicitLittle}) {
      image(
          2, 0, [&](DicomFile& file) { file.syntax = syntax; }, 1);
      const auto path = std::filesystem::directory_iterator(folder_.path())->path();
      std::string bytes = read_bytes(path).substr(132);
      if (!has_meta)
        bytes = bytes.substr(bytes.find(std::string("\x08\0\x08\0", 4)) == 0
                                 ? 0
                                 : bytes.find(std::string("\x08\0\x16\0", 4)));
      write_bytes(path, bytes);
      EXPECT_EQ(order(), std::vector<int>{2}) << has_meta << int(syntax);
      clear();
    }
  }
}

TEST_F(DicomStudy, ReadsTheFolderOfADicomdir) {
  stacks(2, [](DicomFile& file, int t) {
    file.more[kTagTemporalPosition] = fmt::format("IS{}", t + 1);
  });
  write_bytes(folder_ / "DICOMDIR", std::string(128, '\0') + "DICM");
  const auto reader = SequenceReader::open({folder_ / "DICOMDIR"});
  ASSERT_TRUE(reader) << reader.error().message;
  EXPECT_EQ(reader->frame_count(), 2U);
}

TEST_F(DicomStudy, KnowsTheTimesOfFramesThatNothingSteers) {
  stacks(3, [](DicomFile& file, int t) {
    file.more[kTagTemporalPosition] = fmt::format("IS{}", t + 1);
    file.more[kTagAcquisitionTime] = fmt::format("TM10{:02}{:04.1f}", t / 4, 12.5 * t);
  });
  const auto reader = open();
  ASSERT_TRUE(reader) << reader.error().message;
  EXPECT_THAT(reader->times_s(), Pointwise(DoubleNear(1e-9), {0.0, 12.5, 25.0}));
}

TEST(PhaseName, KeepsWhatIsNoNumberOfAPhase) {
  EXPECT_EQ(phase_name("T2 tra 50 %").rest, phase_name("t2 TRA 75%").rest);
  EXPECT_THAT(phase_name("T2 tra 50 %").numbers, ElementsAre(50.0));
  EXPECT_EQ(phase_name("25% In").direction, 1);
  EXPECT_EQ(phase_name("25% Ex.").direction, -1);
  EXPECT_EQ(phase_name("Contrast in vein").direction, 0);
  EXPECT_THAT(phase_name("0-90%").numbers, ElementsAre(0.0, 90.0));
  EXPECT_THAT(phase_name("R -350 ms").numbers, ElementsAre(-350.0));
  EXPECT_THAT(phase_name("").numbers, IsEmpty());
  EXPECT_THAT(phase_name("1.2.3").rest, "1.2.3");
}

}  // namespace
}  // namespace palpate::files
