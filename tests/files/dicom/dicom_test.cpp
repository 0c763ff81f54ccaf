#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "integration/files/dicom/dicom_layout.h"
#include "integration/files/read_sequence.h"
#include "integration/files/read_volume.h"
#include "tests/files/dicom/dicom_files.h"
#include "tests/files/expect_grid.h"
#include "tests/files/itk_images.h"
#include "tests/files/temporary_folder.h"
#include "tests/files/test_images.h"

namespace palpate::files {
namespace {

using ::testing::DoubleNear;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Pointwise;

/// Positions and cosines are written with nine digits: of 170 mm this is 1e-7.
constexpr double kDicomToleranceMm = 1e-6;

constexpr size_t kFrames = 3;

class DicomFolder : public ::testing::Test {
 protected:
  using Edit = std::function<void(DicomFile&, size_t frame)>;

  /// Slices of all frames, with names that do not show their order.
  void write_frames(const Edit& edit, const Grid& grid = oblique_grid(),
                    const std::string& below = "") {
    std::filesystem::create_directories(folder_.path() / below);
    for (size_t k = 0; k < kFrames; ++k) {
      for (int s = 0; s < grid.size.z; ++s) {
        DicomFile file = slice(grid, k, s);
        edit(file, k);
        write_dicom(
            folder_.path() / below /
                (std::to_string((k * 7 + size_t(s) * 5) % 11) + "_" + std::to_string(count_++)),
            file);
      }
    }
  }

  static DicomFile slice(const Grid& grid, size_t frame, int s) {
    DicomFile file;
    file.grid = grid;
    file.slice = s;
    file.instance = int(frame) + 1;
    const size_t n = size_t(grid.size.x) * size_t(grid.size.y);
    for (size_t v = 0; v < n; ++v)
      file.stored.push_back(int(known_value(size_t(s) * n + v, frame)));
    return file;
  }

  Sequence read_known(double slope = 1.0, double intercept = 0.0,
                      const Grid& grid = oblique_grid()) {
    auto found = read_sequence({folder_.path()});
    EXPECT_TRUE(found) << found.error().message;
    if (!found) return {};
    EXPECT_EQ(found->frames.size(), kFrames);
    for (size_t k = 0; k < found->frames.size(); ++k) {
      expect_grid(found->frames[k].grid, grid, kDicomToleranceMm);
      for (size_t v = 0; v < grid.count(); ++v) {
        EXPECT_EQ(found->frames[k].values[v], float(slope * known_value(v, k) + intercept))
            << k << ' ' << v;
      }
    }
    return *found;
  }

  std::string refusal() {
    const auto found = read_sequence({folder_.path()});
    EXPECT_FALSE(found);
    return found ? std::string{} : found.error().message;
  }

  TemporaryFolder folder_;
  int count_ = 0;
};

TEST_F(DicomFolder, IsGroupedByTemporalPosition) {
  write_frames([](DicomFile& file, size_t k) {
    file.more[kTagTemporalPosition] = "IS" + std::to_string(k + 1);
    file.more[kTagTemporalResolution] = "DS40";
  });
  const auto found = read_known();
  EXPECT_TRUE(found.times_known);
  EXPECT_THAT(found.times_s, Pointwise(DoubleNear(1e-12), {0.0, 0.04, 0.08}));
}

TEST_F(DicomFolder, IsGroupedByTriggerTimeEvenIfItDriftsFromSliceToSlice) {
  write_frames([](DicomFile& file, size_t k) {
    file.more[kTagTriggerTime] = "DS" + std::to_string(100.0 * double(k) + 60.0 * file.slice);
  });
  const auto found = read_known();
  EXPECT_TRUE(found.times_known);
  EXPECT_THAT(found.times_s, Pointwise(DoubleNear(1e-12), {0.06, 0.16, 0.26}));
}

TEST_F(DicomFolder, IsGroupedByCardiacPhase) {
  // In the standard this is in single precision (FL).
  write_frames([](DicomFile& file, size_t k) {
    file.more[kTagCardiacPhase] = "FL" + std::to_string(30.0 * double(k));
  });
  EXPECT_FALSE(read_known().times_known);
}

TEST_F(DicomFolder, IsGroupedByAcquisitionTimeAsTheLastResort) {
  // Frames 40 s apart, slices 2 s apart, past midnight between the first and the second frame.
  write_frames([](DicomFile& file, size_t k) {
    const int s = 86370 + 40 * int(k) + 2 * file.slice;
    char text[32];
    std::snprintf(text, sizeof(text), "%02d%02d%02d.25", s / 3600 % 24, s / 60 % 60, s % 60);
    file.more[kTagAcquisitionTime] = std::string("TM") + text;
    file.more[kTagAcquisitionDate] = s < 86400 ? "DA20240228" : "DA20240229";
  });
  const auto found = read_known();
  EXPECT_TRUE(found.times_known);
  // Counted from the first slice of the first frame: 2 s later on average.
  EXPECT_THAT(found.times_s, Pointwise(DoubleNear(1e-6), {2.0, 42.0, 82.0}));
}

TEST_F(DicomFolder, IsGroupedByAcquisitionDateTime) {
  const char* const times[] = {"DT20231231235959.5", "DT20240101000000.25+0100",
                               "DT20240101000001"};
  write_frames([&](DicomFile& file, size_t k) { file.more[kTagAcquisitionDateTime] = times[k]; });
  EXPECT_THAT(read_known().times_s, Pointwise(DoubleNear(1e-6), {0.0, 0.75, 1.5}));
}

TEST_F(DicomFolder, TakesNoTimesFromTheAcquisitionWhereSomethingElseOrdersTheFrames) {
  // Gated: the phases were acquired one after the other, for minutes each.
  write_frames([](DicomFile& file, size_t k) {
    file.more[0x00181062] = "IS900";  // length of a heart beat, ms
    file.more[kTagTemporalPosition] = "IS" + std::to_string(k + 1);
    file.more[kTagAcquisitionTime] = "TM10" + std::to_string(10 + k) + "00";
  });
  EXPECT_FALSE(read_known().times_known);
}

TEST_F(DicomFolder, IsNotGroupedByTimesThatAreNone) {
  for (const char* time : {"TM", "TM9", "TM250000", "TM106000", "TMnoon", "TM1000-1"}) {
    write_frames([&](DicomFile& file, size_t) {
      file.more[kTagAcquisitionTime] = time;
      file.instance = 1;
    });
    EXPECT_THAT(refusal(), HasSubstr("tells them apart")) << time;
    std::filesystem::remove_all(folder_.path());
    std::filesystem::create_directories(folder_.path());
  }
}

TEST_F(DicomFolder, OfPetIsGroupedByFrameReferenceTime) {
  write_frames([](DicomFile& file, size_t k) {
    file.more[kTagFrameReferenceTime] = "DS" + std::to_string(5000.0 * double(k * k) + 250.0);
  });
  EXPECT_THAT(read_known().times_s, Pointwise(DoubleNear(1e-9), {0.25, 5.25, 20.25}));
}

TEST_F(DicomFolder, MayBeInAnyPlainTransferSyntax) {
  for (const DicomSyntax syntax :
       {DicomSyntax::kImplicitLittle, DicomSyntax::kExplicitBig, DicomSyntax::kDeflated}) {
    write_frames([&](DicomFile& file, size_t k) {
      file.more[kTagCardiacPhase] = "FL" + std::to_string(30.0 * double(k));
      file.slope = 0.5;
      file.syntax = syntax;
    });
    read_known(0.5);
    for (const auto& entry : std::filesystem::directory_iterator(folder_.path()))
      std::filesystem::remove(entry.path());
    // The tests' own writer of the syntax is correct if ITK reads the same values.
    DicomFile file = slice(straight_grid({5, 4, 1}), 0, 0);
    file.syntax = syntax;
    write_dicom(folder_ / "a", file);
    const auto one = read_volume(folder_.path());
    ASSERT_TRUE(one) << one.error().message;
    EXPECT_EQ(std::vector<double>(one->values.begin(), one->values.end()),
              itk_oracle::read_dicom(folder_ / "a"));
    std::filesystem::remove(folder_ / "a");
  }
}

TEST_F(DicomFolder, HasBytesInBigEndianWordsOrAsBytes) {
  for (const char* vr : {"OW", "OB"}) {
    // An odd number of pixels: the last word contains one of them.
    DicomFile file = slice(straight_grid({5, 3, 1}), 0, 0);
    file.bits = 8;
    file.pixel_vr = vr;
    file.syntax = DicomSyntax::kExplicitBig;
    write_dicom(folder_ / "a", file);
    const auto found = read_volume(folder_.path());
    ASSERT_TRUE(found) << found.error().message;
    for (size_t v = 0; v < 15; ++v) EXPECT_EQ(found->values[v], known_value(v, 0)) << vr << v;
  }
}

TEST_F(DicomFolder, IsRefusedWhereItIsDeflatedAndCutShort) {
  DicomFile file = slice(straight_grid({5, 4, 1}), 0, 0);
  file.syntax = DicomSyntax::kDeflated;
  write_dicom(folder_ / "a", file);
  const std::string whole = read_bytes(folder_ / "a");
  ASSERT_TRUE(read_volume(folder_.path()));
  for (size_t n = 340; n + 1 < whole.size(); n += 5) {
    write_bytes(folder_ / "a", whole.substr(0, n));
    EXPECT_FALSE(read_volume(folder_.path())) << n;
  }
}

TEST_F(DicomFolder, IsGroupedByAcquisition) {
  write_frames([](DicomFile& file, size_t k) {
    file.more[kTagAcquisitionNumber] = "IS" + std::to_string(k + 4);
  });
  EXPECT_FALSE(read_known().times_known);
}

TEST_F(DicomFolder, TakesOneSeriesPerPhaseInFoldersBelow) {
  for (size_t k = 0; k < kFrames; ++k) {
    std::filesystem::create_directories(folder_ / ("phase" + std::to_string(k)));
    for (int s = 0; s < 3; ++s) {
      DicomFile file = slice(oblique_grid(), k, s);
      file.series = "1.2.3." + std::to_string(9 - k);
      file.series_number = int(k) + 5;
      write_dicom(folder_ / ("phase" + std::to_string(k) + "/" + std::to_string(s)), file);
    }
  }
  read_known();
}

TEST_F(DicomFolder, OrdersSeriesByThePercentageInTheirDescription) {
  write_frames([](DicomFile& file, size_t k) {
    file.series = "1.2.3." + std::to_string(k + 1);
    file.series_number = 9 - int(k);
    file.more[kTagSeriesDescription] = "LOGated, " + std::to_string(5 + 45 * k) + ".0%";
  });
  read_known();
}

TEST_F(DicomFolder, MayBeOneOfSeveralWithAFrameEach) {
  std::vector<std::filesystem::path> folders;
  for (size_t k = 0; k < kFrames; ++k) {
    folders.push_back(folder_ / ("f" + std::to_string(k)));
    std::filesystem::create_directories(folders.back());
    for (int s = 0; s < 3; ++s)
      write_dicom(folders.back() / std::to_string(s), slice(oblique_grid(), k, s));
  }
  const auto found = read_sequence({folders[2], folders[0], folders[1]});
  ASSERT_TRUE(found) << found.error().message;
  const size_t order[] = {2, 0, 1};
  for (size_t n = 0; n < kFrames; ++n)
    EXPECT_EQ(found->frames[n].values, known_volume(oblique_grid(), order[n]).values);
  const auto one = read_volume(folders[1]);
  ASSERT_TRUE(one) << one.error().message;
  EXPECT_EQ(one->values, known_volume(oblique_grid(), 1).values);
}

TEST_F(DicomFolder, AppliesSlopeAndInterceptOnce) {
  write_frames([](DicomFile& file, size_t k) {
    file.more[kTagTemporalPosition] = "IS" + std::to_string(k + 1);
    file.slope = 2.5;
    file.intercept = -1024;
  });
  read_known(2.5, -1024.0);
}

TEST_F(DicomFolder, PassesOverALocaliserAndOtherFiles) {
  write_frames([](DicomFile& file, size_t k) {
    file.more[kTagTemporalPosition] = "IS" + std::to_string(k + 1);
  });
  DicomFile localiser = slice(straight_grid(), 0, 0);
  localiser.series = "1.2.3.77";
  write_dicom(folder_ / "localiser", localiser);
  write_bytes(folder_ / "readme.txt", "not DICOM");
  DicomFile report = slice(straight_grid(), 0, 0);
  report.series = "1.2.3.78";
  report.more = {{0x00280010, ""}, {0x00280011, ""}, {0x00200032, ""}};
  write_dicom(folder_ / "report", report);
  read_known();
}

TEST_F(DicomFolder, SaysWhereSlicesAreUnevenlySpaced) {
  Grid grid = straight_grid({5, 4, 6});
  for (size_t k = 0; k < kFrames; ++k) {
    for (int s = 0; s < 6; ++s) {
      if (s == 3) continue;
      DicomFile file = slice(grid, k, s);
      file.more[kTagTemporalPosition] = "IS" + std::to_string(k + 1);
      write_dicom(folder_ / std::to_string(count_++), file);
    }
  }
  EXPECT_THAT(refusal(),
              HasSubstr("unevenly spaced slices (5 mm between slice 2 and 3, 2.5 mm elsewhere)"));
}

TEST_F(DicomFolder, SaysWhichSliceIsMissingInOneFrame) {
  write_frames([](DicomFile& file, size_t k) {
    file.more[kTagTemporalPosition] = "IS" + std::to_string(k + 1);
  });
  for (const auto& entry : std::filesystem::directory_iterator(folder_.path())) {
    std::filesystem::remove(entry.path());
    break;
  }
  EXPECT_THAT(refusal(), HasSubstr("holds 2 images of slice"));
}

TEST_F(DicomFolder, RefusesATiltedGantry) {
  write_frames([](DicomFile& file, size_t k) {
    file.more[kTagTemporalPosition] = "IS" + std::to_string(k + 1);
    file.grid.origin_mm += file.grid.direction[1] * (0.5 * file.slice);
  });
  EXPECT_THAT(refusal(), HasSubstr("tilted gantry"));
}

TEST_F(DicomFolder, SaysWhenNothingTellsFramesApart) {
  write_frames([](DicomFile& file, size_t) { file.instance = 1; });
  EXPECT_THAT(refusal(), HasSubstr("tells them apart"));
}

TEST_F(DicomFolder, SaysWhenThereAreTwoSequences) {
  write_frames([](DicomFile& file, size_t k) {
    file.more[kTagTemporalPosition] = "IS" + std::to_string(k + 1);
  });
  write_frames([](DicomFile& file, size_t k) {
    file.more[kTagTemporalPosition] = "IS" + std::to_string(k + 1);
    file.series = "1.2.3.9";
  });
  EXPECT_THAT(refusal(), HasSubstr("holds 2 sequences"));
}

TEST_F(DicomFolder, RefusesFramesAndSlicesWithoutAPlace) {
  DicomFile file = slice(straight_grid(), 0, 0);
  file.more[kTagNumberOfFrames] = "IS4";
  write_dicom(folder_ / "a", file);
  EXPECT_THAT(refusal(), HasSubstr("multi-frame DICOM file that does not say where"));
  file.more = {{0x00200032, ""}};
  write_dicom(folder_ / "a", file);
  EXPECT_THAT(refusal(), HasSubstr("where its slice lies"));
}

TEST_F(DicomFolder, RefusesPicturesInColour) {
  DicomFile file = slice(straight_grid(), 0, 0);
  file.more[0x00280002] = "US3";
  write_dicom(folder_ / "a", file);
  EXPECT_THAT(refusal(), HasSubstr("is a colour picture"));
  file.more = {{0x00280004, "CSPALETTE COLOR"}};
  write_dicom(folder_ / "a", file);
  EXPECT_THAT(refusal(), HasSubstr("numbered colours"));
}

TEST_F(DicomFolder, RefusesDamagedFilesWithoutASound) {
  write_frames([](DicomFile& file, size_t k) {
    file.more[kTagTemporalPosition] = "IS" + std::to_string(k + 1);
  });
  const auto victim = std::filesystem::directory_iterator(folder_.path())->path();
  const std::string whole = read_bytes(victim);
  for (const size_t n :
       {whole.size() - 5, whole.size() - 60, whole.size() / 2, size_t(200), size_t(140)}) {
    write_bytes(victim, whole.substr(0, n));
    ::testing::internal::CaptureStderr();
    ::testing::internal::CaptureStdout();
    const auto found = read_sequence({folder_.path()});
    EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
    EXPECT_EQ(::testing::internal::GetCapturedStdout(), "");
    EXPECT_FALSE(found) << n;
  }
}

TEST_F(DicomFolder, ReadsWhatItkWritesPlainAndPacked) {
  const Volume volume = known_volume(straight_grid({8, 6, 4}));
  for (const bool packed : {false, true}) {
    itk_oracle::write_dicom_series(folder_.path(), volume, packed);
    // The UIDs of the JPEG syntaxes begin like this.
    const bool is_jpeg =
        read_bytes(folder_ / "0.dcm").find("1.2.840.10008.1.2.4.") != std::string::npos;
    EXPECT_EQ(is_jpeg, packed);
    const auto found = read_volume(folder_.path());
    ASSERT_TRUE(found) << found.error().message;
    expect_grid(found->grid, volume.grid, kDicomToleranceMm);
    EXPECT_EQ(found->values, volume.values) << packed;
  }
}

/// All slices of all frames in one file, in an arbitrary order.
EnhancedFile enhanced(const std::function<void(EnhancedFrame&, size_t frame)>& edit,
                      const Grid& grid = oblique_grid()) {
  EnhancedFile file;
  file.grid = grid;
  const size_t n = size_t(grid.size.x) * size_t(grid.size.y);
  const size_t count = kFrames * size_t(grid.size.z);
  for (size_t m = 0; m < count; ++m) {
    // 5 and 9 have no common divisor.
    const size_t number = (m * 5) % count, k = number % kFrames;
    EnhancedFrame frame;
    frame.slice = int(number / kFrames);
    for (size_t v = 0; v < n; ++v)
      frame.stored.push_back(int(known_value(size_t(frame.slice) * n + v, k)));
    edit(frame, k);
    file.frames.push_back(std::move(frame));
  }
  return file;
}

DicomValues temporal_index(size_t k) {
  return {{0x00209128, "UL" + std::to_string(k + 1)}};
}

TEST_F(DicomFolder, MayBeOneEnhancedFileInAnySyntax) {
  for (const DicomSyntax syntax : {DicomSyntax::kExplicitLittle, DicomSyntax::kImplicitLittle,
                                   DicomSyntax::kExplicitBig, DicomSyntax::kDeflated}) {
    for (const bool open : {false, true}) {
      EnhancedFile file = enhanced(
          [](EnhancedFrame& frame, size_t k) { frame.groups[0x00209111] = temporal_index(k); });
      file.syntax = syntax;
      file.open_sequences = open;
      write_enhanced(folder_ / "e", file);
      EXPECT_FALSE(read_known().times_known);
    }
  }
  const auto by_name = read_sequence({folder_ / "e"});
  ASSERT_TRUE(by_name) << by_name.error().message;
  EXPECT_EQ(by_name->frames.size(), kFrames);
}

TEST_F(DicomFolder, IsToBeNamedWhereOneSliceOfItIs) {
  write_frames([](DicomFile&, size_t) {});
  const auto slice = std::filesystem::directory_iterator(folder_.path())->path();
  const auto found = read_volume(slice);
  ASSERT_FALSE(found);
  EXPECT_THAT(found.error().message, HasSubstr("name the folder that holds all slices"));
}

TEST_F(DicomFolder, OfAnEnhancedFileHasRescalingPerFrame) {
  write_enhanced(folder_ / "e", enhanced([](EnhancedFrame& frame, size_t k) {
                   frame.groups[0x00209111] = temporal_index(k);
                   frame.slope = 1.0 + double(k);
                   frame.intercept = -10.0 * frame.slice;
                 }));
  const auto found = read_sequence({folder_.path()});
  ASSERT_TRUE(found) << found.error().message;
  const Grid grid = oblique_grid();
  for (size_t k = 0; k < kFrames; ++k) {
    for (size_t v = 0; v < grid.count(); ++v) {
      const double slice = double(v / size_t(grid.size.x * grid.size.y));
      EXPECT_EQ(found->frames[k].values[v],
                float((1.0 + double(k)) * known_value(v, k) - 10.0 * slice));
    }
  }
}

TEST_F(DicomFolder, OfAnEnhancedFileKnowsTheTimesThatItStates) {
  const std::vector<std::pair<unsigned, std::function<DicomValues(size_t)>>> kinds = {
      {0x00189118,  // delay after the R peak, ms
       [](size_t k) {
         return DicomValues{{0x00209153, "FD" + std::to_string(40.0 * double(k))}};
       }},
      {0x00209253,  // delay after the start of a breath, ms
       [](size_t k) {
         return DicomValues{{0x00209255, "FD" + std::to_string(40.0 * double(k))}};
       }},
      {0x00209310,  // offset, s
       [](size_t k) {
         return DicomValues{{0x0020930d, "FD" + std::to_string(0.04 * double(k))}};
       }},
      {0x00209111, [](size_t k) {
         return DicomValues{{0x00189074, "DT2024010110000" + std::to_string(k) + ".04"}};
       }}};
  for (const auto& [group, values] : kinds) {
    const bool is_date = group == 0x00209111;
    write_enhanced(folder_ / "e",
                   enhanced([&, tag = group, make = values](EnhancedFrame& frame, size_t k) {
                     frame.groups[tag] = make(k);
                   }));
    const auto found = read_known();
    EXPECT_TRUE(found.times_known);
    const double step = is_date ? 1.0 : 0.04;
    EXPECT_THAT(found.times_s, Pointwise(DoubleNear(1e-6), {0.0, step, 2.0 * step}));
  }
}

TEST_F(DicomFolder, OfAnEnhancedFileMayLieInTheProbesFrame) {
  // 4D echo: positions and directions of the volume, in binary.
  const Grid grid = oblique_grid();
  EnhancedFile file = enhanced([&](EnhancedFrame& frame, size_t k) {
    const glm::dvec3 x = grid.lps_from_index({0, 0, frame.slice});
    const glm::dvec3 row = grid.direction[0], column = grid.direction[1];
    frame.groups[0x00209111] = temporal_index(k);
    // Without the patient's groups.
    frame.groups[0x00209113] = {};
    frame.groups[0x0020930e] = {{0x00209301, fmt::format("FD{}\\{}\\{}", x.x, x.y, x.z)}};
    frame.groups[0x0020930f] = {{0x00209302, fmt::format("FD{}\\{}\\{}\\{}\\{}\\{}", row.x, row.y,
                                                         row.z, column.x, column.y, column.z)}};
  });
  file.without_orientation = true;
  write_enhanced(folder_ / "e", file);
  read_known();
}

TEST_F(DicomFolder, OfAnEnhancedFileIsReadFromLosslesslyPackedPixels) {
  const TemporaryFolder plain;
  // GDCM's JPEG 2000 encoder writes beyond its buffer if a picture is so small that the encoded one
  // is larger.
  const Grid grid = straight_grid({48, 40, 3});
  write_enhanced(plain / "e", enhanced(
                                  [](EnhancedFrame& frame, size_t k) {
                                    frame.groups[0x00209111] = temporal_index(k);
                                    frame.slope = 0.5;
                                  },
                                  grid));
  // JPEG, JPEG-LS, JPEG 2000 and run lengths.
  for (const char* syntax :
       {"1.2.840.10008.1.2.4.57", "1.2.840.10008.1.2.4.70", "1.2.840.10008.1.2.4.80",
        "1.2.840.10008.1.2.4.90", "1.2.840.10008.1.2.5"}) {
    ASSERT_TRUE(itk_oracle::pack_dicom(plain / "e", folder_ / "e", syntax)) << syntax;
    const std::string packed = read_bytes(folder_ / "e");
    ASSERT_NE(packed.find(syntax), std::string::npos);
    read_known(0.5, 0.0, grid);
    write_bytes(folder_ / "e", with_cut_fragments(packed));
    read_known(0.5, 0.0, grid);
  }
}

TEST_F(DicomFolder, IsRefusedWherePackedPicturesHaveAnotherSize) {
  // GDCM would write as many pixels as the picture has into a buffer of the size that the file
  // claims.
  const TemporaryFolder plain;
  write_enhanced(
      plain / "e",
      enhanced([](EnhancedFrame& frame, size_t k) { frame.groups[0x00209111] = temporal_index(k); },
               straight_grid({48, 40, 3})));
  for (const char* syntax :
       {"1.2.840.10008.1.2.4.70", "1.2.840.10008.1.2.4.80", "1.2.840.10008.1.2.4.90"}) {
    ASSERT_TRUE(itk_oracle::pack_dicom(plain / "e", folder_ / "e", syntax)) << syntax;
    const std::string packed = read_bytes(folder_ / "e");
    struct Change {
      const char* element;
      int value;
    };
    for (const Change change : {Change{"\x28\0\x10\0US\2\0", 20}, Change{"\x28\0\x11\0US\2\0", 47},
                                Change{"\x28\0\0\1US\2\0", 8}}) {
      std::string wrong = packed;
      const size_t at = wrong.find(std::string(change.element, 8));
      ASSERT_NE(at, std::string::npos);
      wrong[at + 8] = char(change.value);
      if (change.value == 8) {
        const size_t stored = wrong.find(std::string("\x28\0\1\1US\2\0", 8));
        ASSERT_NE(stored, std::string::npos);
        wrong[stored + 8] = 8;
      }
      for (const std::string& bytes : {wrong, with_cut_fragments(wrong)}) {
        write_bytes(folder_ / "e", bytes);
        EXPECT_THAT(refusal(), HasSubstr("pixels that can not be read")) << syntax << change.value;
      }
    }
  }
}

TEST_F(DicomFolder, OfAnEnhancedFileIsRefusedWherePackedPixelsAreDamaged) {
  const TemporaryFolder plain;
  write_enhanced(plain / "e", enhanced([](EnhancedFrame& frame, size_t k) {
                   frame.groups[0x00209111] = temporal_index(k);
                 }));
  ASSERT_TRUE(itk_oracle::pack_dicom(plain / "e", folder_ / "e", "1.2.840.10008.1.2.4.70"));
  const std::string whole = read_bytes(folder_ / "e");
  const size_t pixels = whole.find(std::string("\xe0\x7f\x10\x00", 4));
  ASSERT_NE(pixels, std::string::npos);
  for (size_t n = pixels; n < whole.size(); n += 37) {
    write_bytes(folder_ / "e", whole.substr(0, n));
    EXPECT_FALSE(read_sequence({folder_.path()})) << n;
    // Damage inside does not change lengths: the result may be anything, but the program must go
    // on.
    std::string changed = whole;
    changed[n] = char(changed[n] ^ 0x55);
    write_bytes(folder_ / "e", changed);
    const auto found = read_sequence({folder_.path()});
    EXPECT_TRUE(found || found.error().message.size() > 10);
  }
}

TEST_F(DicomFolder, OfJpegLsIsRefusedWhereTheEndMarkerIsGone) {
  // GDCM would not end the decompression of some of these.
  DicomFile file;
  file.grid = straight_grid({64, 48, 1});
  for (int v = 0; v < 64 * 48; ++v) file.stored.push_back(v * 7919 % 1021);
  const TemporaryFolder plain;
  write_dicom(plain / "a", file);
  ASSERT_TRUE(itk_oracle::pack_dicom(plain / "a", folder_ / "a", "1.2.840.10008.1.2.4.80"));
  const std::string whole = read_bytes(folder_ / "a");
  const size_t pixels = whole.find(std::string("\xe0\x7f\x10\x00", 4)),
               end = whole.rfind("\xff\xd9");
  ASSERT_LT(pixels, end);
  for (size_t n = pixels + 80; n < end; n += 41) {
    std::string changed = whole;
    changed[n] = char(changed[n] ^ 0x55);
    changed[end] = 0x2a;
    write_bytes(folder_ / "a", changed);
    const auto found = read_volume(folder_.path());
    ASSERT_FALSE(found) << n;
    EXPECT_THAT(found.error().message, HasSubstr("pixels that can not be read"));
  }
}

TEST_F(DicomFolder, OfAnEnhancedFileIsRefusedWhereFramesAndDescriptionsDiffer) {
  EnhancedFile file = enhanced(
      [](EnhancedFrame& frame, size_t k) { frame.groups[0x00209111] = temporal_index(k); });
  file.more[kTagNumberOfFrames] = "IS12";
  write_enhanced(folder_ / "e", file);
  EXPECT_THAT(refusal(), HasSubstr("claims 12 frames but describes 9"));
  file.more[kTagNumberOfFrames] = "IS9";
  file.frames.back().stored.resize(3);
  write_enhanced(folder_ / "e", file);
  EXPECT_THAT(refusal(), HasSubstr("cut short within its pixels"));
}

TEST_F(DicomFolder, HasTheValuesThatItkFindsWhateverTheBits) {
  struct Bits {
    int stored;
    int is_signed;
  };
  for (const Bits bits : {Bits{16, 1}, Bits{16, 0}, Bits{12, 1}, Bits{12, 0}}) {
    DicomFile file = slice(straight_grid({5, 4, 1}), 0, 0);
    for (size_t v = 0; v < file.stored.size(); ++v)
      file.stored[v] = int(v * 331) - (bits.is_signed ? 2000 : 0);
    for (int& value : file.stored) value = bits.stored == 12 ? value & 0xfff : value;
    file.slope = 0.5;
    file.intercept = -100.25;
    file.more = {{0x00280101, "US" + std::to_string(bits.stored)},
                 {0x00280102, "US" + std::to_string(bits.stored - 1)},
                 {0x00280103, "US" + std::to_string(bits.is_signed)}};
    write_dicom(folder_ / "a", file);
    const auto found = read_volume(folder_.path());
    ASSERT_TRUE(found) << found.error().message;
    const auto by_itk = itk_oracle::read_dicom(folder_ / "a");
    for (size_t v = 0; v < by_itk.size(); ++v) {
      EXPECT_EQ(found->values[v], float(by_itk[v]))
          << bits.stored << ' ' << bits.is_signed << ' ' << v;
    }
  }
}

TEST_F(DicomFolder, OfLossyPixelsHasTheValuesThatItkFinds) {
  // The darkest values next to the brightest: lossy compression makes values exceed both ends of 12
  // bits.
  for (const bool is_signed : {false, true}) {
    const int least = is_signed ? -2048 : 0;
    DicomFile file;
    file.grid = straight_grid({48, 40, 1});
    for (int v = 0; v < 48 * 40; ++v)
      file.stored.push_back((v / 48 / 5 + v % 48 / 5) % 2 == 0 ? least : least + 4095);
    file.more = {{0x00280101, "US12"}, {0x00280102, "US11"}};
    file.more[0x00280103] = is_signed ? "US1" : "US0";
    const TemporaryFolder plain;
    write_dicom(plain / "a", file);
    // JPEG of three processes, JPEG-LS, JPEG 2000.
    for (const char* syntax :
         {"1.2.840.10008.1.2.4.51", "1.2.840.10008.1.2.4.53", "1.2.840.10008.1.2.4.55",
          "1.2.840.10008.1.2.4.81", "1.2.840.10008.1.2.4.91"}) {
      const bool jpeg_2000 = std::string(syntax).ends_with("91");
      if (!itk_oracle::pack_dicom(plain / "a", folder_ / "a", syntax, jpeg_2000 ? 20.0 : 0.0)) {
        ASSERT_TRUE(is_signed && !jpeg_2000) << syntax;
        continue;
      }
      const auto found = read_volume(folder_.path());
      ASSERT_TRUE(found) << found.error().message;
      EXPECT_EQ(std::vector<double>(found->values.begin(), found->values.end()),
                itk_oracle::read_dicom(folder_ / "a"))
          << syntax << ' ' << is_signed;
      if (jpeg_2000) {
        EXPECT_GT(*std::max_element(found->values.begin(), found->values.end()), least + 4095);
      }
    }
  }
}

TEST_F(DicomFolder, WalksThroughSequencesOfKnownAndOpenLength) {
  // A sequence with an item of undefined length that contains a sequence with an item of known
  // length.
  const std::string open("\xff\xff\xff\xff", 4);
  const std::string inner =
      std::string("\xfe\xff\x00\xe0\x0a\x00\x00\x00", 8) + std::string(
                                                               "\x08\x00\x00\x01SH\x02\x00"
                                                               "ab",
                                                               10);
  const std::string nested = std::string("\x08\x00\x15\x11SQ\x00\x00\x12\x00\x00\x00", 12) + inner;
  const std::string items = std::string("\xfe\xff\x00\xe0", 4) + open + nested +
                            std::string("\xfe\xff\x0d\xe0\0\0\0\0", 8);
  const std::string sequence = std::string("\x08\x00\x40\x11SQ\x00\x00", 8) + open + items +
                               std::string("\xfe\xff\xdd\xe0\0\0\0\0", 8);
  DicomFile file = slice(straight_grid({5, 4, 1}), 0, 0);
  write_dicom(folder_ / "a", file);
  std::string bytes = read_bytes(folder_ / "a");
  const size_t at = bytes.find(std::string("\x10\x00\x10\x00PN", 6));
  ASSERT_NE(at, std::string::npos);
  bytes.insert(at, sequence);
  write_bytes(folder_ / "a", bytes);
  const auto found = read_volume(folder_.path());
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_EQ(found->values, known_volume(straight_grid({5, 4, 1})).values);
}

}  // namespace
}  // namespace palpate::files
