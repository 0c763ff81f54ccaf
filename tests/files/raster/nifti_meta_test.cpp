// Features of NIfTI and MetaImage that ITK does not write: scaling, units, swapped bytes, pairs,
// lists, a qform alone.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "integration/files/frames.h"
#include "integration/files/raster/image_writer.h"
#include "integration/files/raster/write_field.h"
#include "integration/files/raster/write_volume.h"
#include "integration/files/read_sequence.h"
#include "integration/files/read_volume.h"
#include "tests/files/expect_grid.h"
#include "tests/files/itk_images.h"
#include "tests/files/raster/nifti2.h"
#include "tests/files/raster/packed.h"
#include "tests/files/temporary_folder.h"
#include "tests/files/test_images.h"

namespace palpate::files {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// Header of a straight or oblique float volume, as NIfTI-1 lays it out.
std::string nifti_header(const Grid& grid) {
  ImageToWrite picture;
  picture.grid = grid;
  picture.frames = {nullptr};
  return nifti_header_of(picture);
}

/// Reverses every field of a NIfTI-1 header, as a machine of the other byte order writes it.
std::string swapped_header(std::string bytes) {
  const auto swap_all = [&](size_t begin, size_t count, size_t width) {
    for (size_t n = 0; n < count; ++n)
      std::reverse(bytes.begin() + begin + n * width, bytes.begin() + begin + (n + 1) * width);
  };
  swap_all(0, 1, 4);     // sizeof_hdr
  swap_all(40, 8, 2);    // dim
  swap_all(56, 3, 4);    // intent_p
  swap_all(68, 4, 2);    // intent_code, datatype, bitpix, slice_start
  swap_all(76, 11, 4);   // pixdim, vox_offset, scl
  swap_all(120, 1, 2);   // slice_end
  swap_all(124, 4, 4);   // cal, duration, toffset
  swap_all(252, 2, 2);   // form codes
  swap_all(256, 18, 4);  // quatern, offsets, srows
  return bytes;
}

TEST(NiftiReader, AppliesSlopeAndInterceptOnceAsItkDoes) {
  const TemporaryFolder folder;
  std::string header = nifti_header(oblique_grid());
  put<int16_t>(header, 70, 4);
  put<int16_t>(header, 72, 16);
  put<float>(header, 112, 2.5f);
  put<float>(header, 116, -1024.0f);
  const Volume raw = known_volume(oblique_grid());
  write_bytes(folder / "v.nii", header + bytes_of_values<int16_t>(raw.values));
  write_bytes(folder / "v.nii.gz", gzip(header + bytes_of_values<int16_t>(raw.values)));
  const auto by_itk = itk_oracle::read(folder / "v.nii");
  for (const char* name : {"v.nii", "v.nii.gz"}) {
    const auto found = read_volume(folder / name);
    ASSERT_TRUE(found) << found.error().message;
    for (size_t v = 0; v < raw.values.size(); ++v)
      EXPECT_EQ(found->values[v], 2.5f * raw.values[v] - 1024.0f) << v;
    EXPECT_EQ(found->values, by_itk.values);
  }
}

TEST(NiftiReader, LeavesValuesAloneWhereTheSlopeIsZero) {
  const TemporaryFolder folder;
  std::string header = nifti_header(straight_grid());
  put<float>(header, 112, 0.0f);
  put<float>(header, 116, 7.0f);
  write_bytes(folder / "v.nii",
              header + bytes_of_values<float>(known_volume(straight_grid()).values));
  const auto found = read_volume(folder / "v.nii");
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_EQ(found->values, known_volume(straight_grid()).values);
}

TEST(NiftiReader, ReadsTheOtherByteOrder) {
  const TemporaryFolder folder;
  std::string data = bytes_of_values<float>(known_volume(oblique_grid()).values);
  for (size_t b = 0; b < data.size(); b += 4) std::reverse(data.begin() + b, data.begin() + b + 4);
  write_bytes(folder / "v.nii", swapped_header(nifti_header(oblique_grid())) + data);
  const auto found = read_volume(folder / "v.nii");
  ASSERT_TRUE(found) << found.error().message;
  expect_grid(found->grid, oblique_grid(), kNiftiToleranceMm);
  EXPECT_EQ(found->values, known_volume(oblique_grid()).values);
}

TEST(NiftiReader, TakesTheQformWhereThereIsNoSformAndTheReverse) {
  const TemporaryFolder folder;
  const std::string data = bytes_of_values<float>(known_volume(oblique_grid()).values);
  for (const size_t code_to_clear : {252u, 254u}) {
    std::string header = nifti_header(oblique_grid());
    put<int16_t>(header, code_to_clear, 0);
    write_bytes(folder / "v.nii", header + data);
    const auto found = read_volume(folder / "v.nii");
    ASSERT_TRUE(found) << found.error().message;
    expect_grid(found->grid, oblique_grid(), kNiftiToleranceMm);
  }
}

TEST(NiftiReader, PlacesAFileWithoutFormsWhereItkDoes) {
  const TemporaryFolder folder;
  std::string header = nifti_header(oblique_grid());
  put<int16_t>(header, 252, 0);
  put<int16_t>(header, 254, 0);
  write_bytes(folder / "v.nii",
              header + bytes_of_values<float>(known_volume(oblique_grid()).values));
  const auto found = read_volume(folder / "v.nii");
  ASSERT_TRUE(found) << found.error().message;
  expect_grid(found->grid, itk_oracle::read(folder / "v.nii").grid, kNiftiToleranceMm);
}

TEST(NiftiReader, ReadsNifti2LikeNifti1) {
  const TemporaryFolder folder;
  const std::string data = bytes_of_values<float>(known_volume(oblique_grid(), 0).values) +
                           bytes_of_values<float>(known_volume(oblique_grid(), 1).values);
  std::string header = nifti_header(oblique_grid());
  put<int16_t>(header, 40, 4);
  put<int16_t>(header, 48, 2);
  put<float>(header, 92, 20.0f);
  put<float>(header, 112, 2.0f);
  put<float>(header, 116, -3.0f);
  put<float>(header, 136, 5.0f);
  put<uint8_t>(header, 123, 2 + 16);
  write_bytes(folder / "one.nii", header + data);
  write_bytes(folder / "two.nii", nifti2_of(header) + data);
  write_bytes(folder / "two.nii.gz", gzip(nifti2_of(header) + data));
  const auto one = read_sequence({folder / "one.nii"});
  ASSERT_TRUE(one) << one.error().message;
  for (const char* name : {"two.nii", "two.nii.gz"}) {
    const auto two = read_sequence({folder / name});
    ASSERT_TRUE(two) << two.error().message;
    ASSERT_EQ(two->frames.size(), 2U);
    EXPECT_EQ(two->times_s, one->times_s);
    EXPECT_TRUE(two->times_known);
    for (size_t k = 0; k < 2; ++k) {
      expect_grid(two->frames[k].grid, oblique_grid(), kNiftiToleranceMm);
      EXPECT_EQ(two->frames[k].values, one->frames[k].values);
    }
  }
  // A field in the other version: vectors, with each of the two intents.
  const Field field = known_field(oblique_grid());
  ASSERT_TRUE(write_field(field, folder / "u.nii"));
  const std::string u = read_bytes(folder / "u.nii");
  write_bytes(folder / "u2.nii", nifti2_of(u.substr(0, 352)) + u.substr(352));
  const auto found = read_field(folder / "u2.nii");
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_EQ(found->u_mm, field.u_mm);
}

TEST(NiftiReader, RefusesADamagedNifti2) {
  const TemporaryFolder folder;
  const std::string header = nifti2_of(nifti_header(straight_grid()));
  const std::string data = bytes_of_values<float>(known_volume(straight_grid()).values);
  const auto refusal = [&](const std::string& bytes) {
    write_bytes(folder / "v.nii", bytes);
    const auto found = read_volume(folder / "v.nii");
    return found ? std::string("read") : found.error().message;
  };
  ASSERT_EQ(refusal(header + data), "read");
  EXPECT_THAT(refusal(header.substr(0, 500)), HasSubstr("500 of 540 bytes"));
  std::string wrong = header;
  put<int64_t>(wrong, 16, int64_t(1) << 40);
  EXPECT_THAT(refusal(wrong + data), HasSubstr("dimensions"));
  wrong = header;
  put<int64_t>(wrong, 24, int64_t(1) << 40);
  EXPECT_THAT(refusal(wrong + data), HasSubstr("absurd size"));
  wrong = header;
  put<int64_t>(wrong, 168, -1);
  EXPECT_THAT(refusal(wrong + data), HasSubstr("byte -1"));
  wrong = header;
  // The line end that detects damage by text transfer.
  wrong[8] = '!';
  EXPECT_THAT(refusal(wrong + data), HasSubstr("not a NIfTI file"));
}

TEST(NiftiReader, SaysWhichFormIsUsedWhereTheyDifferByMoreThanHalfAVoxel) {
  const TemporaryFolder folder;
  const std::string data = bytes_of_values<float>(known_volume(oblique_grid()).values);
  struct FormCase {
    int sform_code;
    double shift_mm;
    /// Null: no message about it.
    const char* used;
  };
  // The finest axis has 0.75 mm. ITK takes the sform if it names scanner coordinates (code 1).
  for (const FormCase& c :
       {FormCase{1, 0.37, nullptr}, FormCase{1, 0.38, "sform"}, FormCase{2, 0.38, "qform"},
        FormCase{2, 0.37, nullptr}, FormCase{0, 9.0, nullptr}}) {
    std::string header = nifti_header(oblique_grid());
    put<int16_t>(header, 254, int16_t(c.sform_code));
    float x = 0.0F;
    std::memcpy(&x, header.data() + 292, sizeof(x));
    put<float>(header, 292, x + float(c.shift_mm));
    write_bytes(folder / "v.nii", header + data);
    Notes notes;
    const auto found = read_volume(folder / "v.nii", &notes);
    ASSERT_TRUE(found) << found.error().message;
    expect_grid(found->grid, itk_oracle::read(folder / "v.nii").grid, kNiftiToleranceMm);
    ASSERT_EQ(notes.size(), c.used ? 1U : 0U) << c.sform_code << ' ' << c.shift_mm;
    if (!c.used) continue;
    EXPECT_THAT(notes[0], HasSubstr("v.nii"));
    EXPECT_THAT(notes[0], HasSubstr(std::string("the ") + c.used + " is used"));
    EXPECT_THAT(notes[0], HasSubstr("0.38 mm"));
  }
}

TEST(NiftiReader, SaysOnceWhatIsTrueOfSeveralFrames) {
  const TemporaryFolder folder;
  for (int k = 0; k < 4; ++k) {
    std::string header = nifti_header(straight_grid());
    if (k > 0) put<float>(header, 268, 100.0F);  // qoffset_x
    write_bytes(folder / (std::to_string(k) + ".nii"),
                header + bytes_of_values<float>(known_volume(straight_grid()).values));
  }
  const auto reader = SequenceReader::open({folder.path()});
  ASSERT_TRUE(reader) << reader.error().message;
  EXPECT_THAT(reader->notes(),
              ElementsAre(HasSubstr("1.nii"), "So it is with 2 more of the frames."));
}

TEST(NiftiReader, SeesFormsThatAgreeAtTheOriginOnly) {
  const TemporaryFolder folder;
  std::string header = nifti_header(straight_grid());
  // k is reversed in the sform: at 2 voxels of 2.5 mm from the origin the two forms are 10 mm
  // apart.
  put<float>(header, 280 + 32 + 8, -2.5F);
  write_bytes(folder / "v.nii",
              header + bytes_of_values<float>(known_volume(straight_grid()).values));
  Notes notes;
  ASSERT_TRUE(read_mask(folder / "v.nii", &notes));
  ASSERT_EQ(notes.size(), 1U);
  EXPECT_THAT(notes[0], HasSubstr("by up to 10 mm"));
}

TEST(NiftiReader, HonoursUnitsOfSpaceAndTime) {
  const TemporaryFolder folder;
  const std::string data = bytes_of_values<float>(known_volume(straight_grid(), 0).values) +
                           bytes_of_values<float>(known_volume(straight_grid(), 1).values);
  struct Units {
    int code;
    double mm, s;
  };
  for (const Units unit : {Units{2 + 8, 1.0, 1.0}, Units{2 + 16, 1.0, 1e-3}, Units{1 + 8, 1e3, 1.0},
                           Units{3 + 24, 1e-3, 1e-6}}) {
    std::string header = nifti_header(straight_grid());
    put<int16_t>(header, 40, 4);
    put<int16_t>(header, 48, 2);
    put<float>(header, 92, 20.0f);
    put<float>(header, 136, 5.0f);
    put<uint8_t>(header, 123, uint8_t(unit.code));
    write_bytes(folder / "v.nii", header + data);
    const auto found = read_sequence({folder / "v.nii"});
    ASSERT_TRUE(found) << found.error().message;
    EXPECT_TRUE(found->times_known);
    EXPECT_THAT(found->times_s, ElementsAre(5.0 * unit.s, 25.0 * unit.s));
    // 0.75 and -31.5 are exact in single precision.
    EXPECT_DOUBLE_EQ(found->frames[0].grid.spacing_mm.x, 0.75 * unit.mm);
    EXPECT_DOUBLE_EQ(found->frames[0].grid.origin_mm.x, -31.5 * unit.mm);
  }
}

TEST(NiftiReader, ReadsAPairOfHeaderAndImage) {
  const TemporaryFolder folder;
  std::string header = nifti_header(straight_grid()).substr(0, 348);
  header.replace(344, 3, "ni1");
  put<float>(header, 108, 0.0f);
  write_bytes(folder / "v.hdr", header);
  write_bytes(folder / "v.img", bytes_of_values<float>(known_volume(straight_grid()).values));
  const auto found = read_volume(folder / "v.hdr");
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_EQ(found->values, known_volume(straight_grid()).values);
  std::filesystem::remove(folder / "v.img");
  const auto lost = read_volume(folder / "v.hdr");
  ASSERT_FALSE(lost);
  EXPECT_THAT(lost.error().message, HasSubstr("v.img"));
}

TEST(NiftiReader, FindsSamplesBehindTheHeaderWhereItDoesNotSayWhere) {
  const TemporaryFolder folder;
  std::string header = nifti_header(straight_grid());
  const std::string samples = bytes_of_values<float>(known_volume(straight_grid()).values);
  put<float>(header, 108, 0.0f);
  std::string nifti2 = nifti2_of(header);
  put<int64_t>(nifti2, 168, 0);
  for (const std::string& bytes : {header + samples, nifti2 + samples}) {
    write_bytes(folder / "v.nii", bytes);
    const auto found = read_volume(folder / "v.nii");
    ASSERT_TRUE(found) << found.error().message;
    EXPECT_EQ(found->values, known_volume(straight_grid()).values);
  }
  // Anything else before the end of the header is damage.
  put<float>(header, 108, 100.0f);
  write_bytes(folder / "v.nii", header + samples);
  EXPECT_FALSE(read_volume(folder / "v.nii"));
}

TEST(NiftiReader, ReadsAPictureOfTwoDimensionsAsASlice) {
  const TemporaryFolder folder;
  std::string header = nifti_header(straight_grid({5, 4, 1}));
  put<int16_t>(header, 40, 2);
  put<int16_t>(header, 46, 0);  // beyond the dimensions the header says nothing
  put<float>(header, 88, 0.0f);
  for (int r = 0; r < 3; ++r) put<float>(header, 288 + 16 * size_t(r), 0.0f);
  const std::string samples = bytes_of_values<float>(known_volume(straight_grid({5, 4, 1})).values);
  for (const int form : {1, 0}) {
    put<int16_t>(header, 252, int16_t(form));
    put<int16_t>(header, 254, int16_t(form));
    write_bytes(folder / "v.nii", header + samples);
    const auto found = read_volume(folder / "v.nii");
    ASSERT_TRUE(found) << found.error().message;
    EXPECT_EQ(found->grid.size, glm::ivec3(5, 4, 1));
    EXPECT_LT(glm::length(found->grid.spacing_mm - glm::dvec3(0.75, 1.25, 1.25)),
              kNiftiToleranceMm);
    EXPECT_EQ(found->values, known_volume(straight_grid({5, 4, 1})).values);
  }
}

TEST(NotANumber, BecomesTheValueThatIsAskedForAndIsTakenOutOfTheMask) {
  const TemporaryFolder folder;
  for (const bool mirrored : {false, true}) {
    Grid grid = oblique_grid();
    grid.j_reversed_in_file = mirrored;
    Sequence frames{"", {known_volume(grid), known_volume(grid, 1)}, {0.0, 1.0}, true};
    frames.frames[0].values[grid.offset(1, 0, 2)] = NAN;
    frames.frames[1].values[grid.offset(4, 3, 0)] = NAN;
    ASSERT_TRUE(write_sequence(frames, folder / "s.seq.nrrd"));
    for (size_t k = 0; k < 2; ++k)
      ASSERT_TRUE(write_volume(frames.frames[k], folder / fmt::format("f{}.nii", k)));
    using Paths = std::vector<std::filesystem::path>;
    for (const Paths& inputs :
         {Paths{folder / "s.seq.nrrd"}, Paths{folder / "f0.nii", folder / "f1.nii"}}) {
      auto refused = SequenceReader::open(inputs);
      ASSERT_TRUE(refused) << refused.error().message;
      const auto bad = refused->frame(0);
      ASSERT_FALSE(bad);
      EXPECT_EQ(bad.error().kind, ErrorKind::kNotFinite);
      auto reader = SequenceReader::open(inputs, -7.5F);
      ASSERT_TRUE(reader);
      EXPECT_TRUE(reader->numbers().empty());
      for (size_t k = 0; k < 2; ++k) {
        const auto frame = reader->frame(k);
        ASSERT_TRUE(frame) << frame.error().message;
        Volume wanted = frames.frames[k];
        for (float& value : wanted.values)
          if (std::isnan(value)) value = -7.5F;
        EXPECT_EQ(frame->values, wanted.values);
      }
      Notes notes;
      const auto made = mask_of_numbers(inputs, 0.0F, {}, &notes);
      ASSERT_TRUE(made && *made);
      std::vector<uint8_t> wanted(grid.count(), 1);
      wanted[grid.offset(1, 0, 2)] = wanted[grid.offset(4, 3, 0)] = 0;
      EXPECT_EQ((*made)->values, wanted);
      ASSERT_EQ(notes.size(), 1U);
      EXPECT_THAT(notes.front(), HasSubstr("3.3 %"));
      // A given mask loses them too.
      wanted[0] = 0;
      Mask given{grid, std::vector<uint8_t>(grid.count(), 1)};
      given.values[0] = 0;
      const auto both = mask_of_numbers(inputs, 0.0F, given);
      ASSERT_TRUE(both && *both);
      EXPECT_EQ((*both)->values, wanted);
    }
  }
  // Without NaN there is no mask to make; infinite values stay refused.
  ASSERT_TRUE(write_volume(known_volume(straight_grid()), folder / "v.nii"));
  const auto none = mask_of_numbers({folder / "v.nii"}, 0.0F, {});
  ASSERT_TRUE(none);
  EXPECT_FALSE(*none);
  Volume infinite = known_volume(straight_grid());
  infinite.values[5] = INFINITY;
  ASSERT_TRUE(write_volume(infinite, folder / "v.nii"));
  EXPECT_FALSE(read_volume(folder / "v.nii", nullptr, 0.0F));
}

TEST(NiftiReader, SaysThatAPackedFileIsNone) {
  const TemporaryFolder folder;
  write_bytes(folder / "v.dcm.gz", gzip(std::string(128, ' ') + "DICM" + std::string(2000, ' ')));
  write_bytes(folder / "v.mgz", gzip(std::string(2000, ' ')));
  const auto dicom = read_volume(folder / "v.dcm.gz"), other = read_volume(folder / "v.mgz");
  ASSERT_FALSE(dicom);
  ASSERT_FALSE(other);
  EXPECT_THAT(dicom.error().message, HasSubstr("(it is DICOM): unpack it"));
  EXPECT_THAT(other.error().message, HasSubstr("no NIfTI image: unpack it"));
}

const char* const kMetaHeader =
    "ObjectType = Image\nNDims = 3\nDimSize = 5 4 3\nElementSpacing = 0.75 1.25 2.5\nPosition = "
    "-31.5 12.25 170.125\n";

class MetaReader : public ::testing::Test {
 protected:
  void expect_known(const std::string& lines, const std::string& data, float slope = 1.0f,
                    float intercept = 0.0f) {
    write_bytes(folder_ / "v.mha", kMetaHeader + lines + data);
    const auto found = read_volume(folder_ / "v.mha");
    ASSERT_TRUE(found) << found.error().message;
    expect_grid(found->grid, straight_grid(), kTextToleranceMm);
    for (size_t v = 0; v < 60; ++v)
      EXPECT_EQ(found->values[v], slope * known_value(v, 0) + intercept) << v;
  }
  const std::string bytes_ = bytes_of_values<int16_t>(known_volume(straight_grid()).values);
  TemporaryFolder folder_;
};

TEST_F(MetaReader, AppliesTheIntensityFunction) {
  expect_known(
      "ElementToIntensityFunctionSlope = 0.5\nElementToIntensityFunctionOffset = -3\nElementType = "
      "MET_SHORT\n"
      "ElementDataFile = LOCAL\n",
      bytes_, 0.5f, -3.0f);
}

TEST_F(MetaReader, ReadsTextAndTheOtherByteOrder) {
  std::string text;
  for (const float value : known_volume(straight_grid()).values)
    text += std::to_string(int(value)) + " ";
  expect_known("BinaryData = False\nElementType = MET_SHORT\nElementDataFile = LOCAL\n", text);
  std::string swapped = bytes_;
  for (size_t b = 0; b < swapped.size(); b += 2) std::swap(swapped[b], swapped[b + 1]);
  expect_known("ElementByteOrderMSB = True\nElementType = MET_SHORT\nElementDataFile = LOCAL\n",
               swapped);
}

TEST_F(MetaReader, ReadsListsOfSliceFilesAndSkipsTheirHeaders) {
  for (size_t k = 0; k < 3; ++k)
    write_bytes(folder_ / ("s" + std::to_string(k)), "head" + bytes_.substr(k * 40, 40));
  expect_known("HeaderSize = 4\nElementType = MET_SHORT\nElementDataFile = LIST\ns0\ns1\ns2\n", "");
  expect_known("HeaderSize = -1\nElementType = MET_SHORT\nElementDataFile = LIST 2D\ns0\ns1\ns2\n",
               "");
}

}  // namespace
}  // namespace palpate::files
