#include "integration/files/dicom/dicom_identity.h"

#include <gtest/gtest.h>

namespace palpate::files {
namespace {

TEST(DicomIdentity, IsTakenOutOfWhatIsShown) {
  DicomElements file;
  file.values = {{0x00100010, "Mertens^Max^ "},
                 {0x00100020, "AB-4711 "},
                 {0x00100030, "19430217"},
                 {0x00101001, "Mert^Ida\\Stein^Ida"},
                 {0x00380010, "7"}};
  const auto shown = [&](const std::string& text) { return without_identity(text, file); };
  EXPECT_EQ(shown("Thorax 30%"), "Thorax 30%");
  EXPECT_EQ(shown("MERTENS_Thorax ab-4711 30%"), "***_Thorax *** 30%");
  EXPECT_EQ(shown("ThoraxMertens19430217"), "Thorax******");
  EXPECT_EQ(shown("Steinmertens, Ida"), "******, ***");
  EXPECT_EQ(shown("Mertens30%"), "***30%");
  // Short names are parts of other words.
  EXPECT_EQ(shown("max MaxIP Mert"), "*** MaxIP ***");
  // One digit is no number of a patient; initials are no name.
  EXPECT_EQ(shown("T=70%"), "T=70%");
  EXPECT_EQ(shown(""), "");
  EXPECT_EQ(without_identity("Mertens", {}), "Mertens");
}

}  // namespace
}  // namespace palpate::files
