#include "integration/files/landmarks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/files/temporary_folder.h"

namespace palpate::files {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::vector<glm::dvec3> points(const char* name, std::string_view text) {
  const auto found = parse_landmarks(name, text);
  EXPECT_TRUE(found) << found.error().message;
  return found ? found->points_lps_mm : std::vector<glm::dvec3>{};
}

std::string landmarks_refusal(const char* name, std::string_view text) {
  const auto found = parse_landmarks(name, text);
  EXPECT_FALSE(found);
  return found ? std::string{} : found.error().message;
}

TEST(LandmarkReader, TakesPlainTablesAsLps) {
  for (const char* text :
       {"1,2.5,-3\n4,5,6\n", "x,y,z\n1,2.5,-3\n4,5,6",
        "# a comment\n\nx y z\n1 2.5 -3\r\n4 5 6\r\n", "X (mm);Y (mm);Z (mm)\n1;2.5;-3\n4;5;6\n",
        "\xef\xbb\xbf"
        "1\t2.5\t-3\n4\t5\t6\n"}) {
    EXPECT_THAT(points("p.csv", text), ElementsAre(glm::dvec3(1, 2.5, -3), glm::dvec3(4, 5, 6)))
        << text;
  }
}

TEST(LandmarkReader, FindsColumnsByTheirNames) {
  EXPECT_THAT(points("p.csv", "point,z,x,y\n0,3,1,2\n1,6,4,5\n"),
              ElementsAre(glm::dvec3(1, 2, 3), glm::dvec3(4, 5, 6)));
}

TEST(LandmarkReader, HonoursTheCoordinateSystemOfSlicer) {
  const std::string columns =
      "# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n";
  const std::string row = "vtkMRMLMarkupsFiducialNode_0,1,2,3,0,0,0,1,1,1,0,F-1,,\n";
  const std::string version = "# Markups fiducial file version = 4.10\n";
  EXPECT_THAT(points("p.fcsv", version + "# CoordinateSystem = 0\n" + columns + row),
              ElementsAre(glm::dvec3(-1, -2, 3)));
  EXPECT_THAT(points("p.fcsv", version + "# CoordinateSystem = RAS\n" + columns + row),
              ElementsAre(glm::dvec3(-1, -2, 3)));
  EXPECT_THAT(points("p.fcsv", version + "# CoordinateSystem = LPS\n" + columns + row),
              ElementsAre(glm::dvec3(1, 2, 3)));
  EXPECT_THAT(points("p.fcsv", version + "# CoordinateSystem = 1\n" + columns + row),
              ElementsAre(glm::dvec3(1, 2, 3)));
  EXPECT_THAT(points("p.fcsv", row), ElementsAre(glm::dvec3(-1, -2, 3)));
  EXPECT_THAT(landmarks_refusal("p.fcsv", "# CoordinateSystem = IJK\n" + row), HasSubstr("'ijk'"));
}

TEST(LandmarkReader, TakesOneFrameOfPointsThatWereFollowed) {
  const auto frame = [](int which, std::string_view text) {
    const auto found = parse_followed_points("way.csv", text, which);
    EXPECT_TRUE(found) << found.error().message;
    return found ? found->points_lps_mm : std::vector<glm::dvec3>{};
  };
  const char* way =
      "# two points\nx0,y0,z0,x1,y1,z1,x10,y10,z10\n1,2,3,4,5,6,7,8,9\n-1,0,0,0,0,0.5,0,0,2\n";
  EXPECT_THAT(frame(0, way), ElementsAre(glm::dvec3(1, 2, 3), glm::dvec3(-1, 0, 0)));
  EXPECT_THAT(frame(1, way), ElementsAre(glm::dvec3(4, 5, 6), glm::dvec3(0, 0, 0.5)));
  EXPECT_THAT(frame(10, way), ElementsAre(glm::dvec3(7, 8, 9), glm::dvec3(0, 0, 2)));
  // As spreadsheets write it: a byte order mark, semicolons, capitals, another order of columns.
  EXPECT_THAT(frame(0, "\xef\xbb\xbfX0; Z0; Y0\n1;3;2\n"), ElementsAre(glm::dvec3(1, 2, 3)));
  EXPECT_THAT(frame(0, "# CoordinateSystem = RAS\nx0 y0 z0\n1 2 3\n"),
              ElementsAre(glm::dvec3(-1, -2, 3)));
}

TEST(LandmarkReader, SaysWhichFrameHasNoPoints) {
  const auto said = [](int which, std::string_view text) {
    const auto found = parse_followed_points("way.csv", text, which);
    EXPECT_FALSE(found);
    return found ? std::string{} : found.error().message;
  };
  EXPECT_THAT(said(2, "x0,y0,z0,x1,y1,z1\n1,2,3,4,5,6\n"),
              HasSubstr("has no columns x2, y2, z2: name another frame"));
  EXPECT_THAT(said(0, "x0,y0\n1,2\n"), HasSubstr("has no columns x0, y0, z0"));
  EXPECT_THAT(said(0, "1,2,3\n"), HasSubstr("has no columns x0, y0, z0"));
  EXPECT_THAT(said(0, "x0,y0,z0\n1,2,nan\n"), HasSubstr("line 2 ('1,2,nan')"));
  EXPECT_THAT(said(0, "x0,y0,z0\n"), HasSubstr("holds no points"));
  EXPECT_THAT(said(0, ""), HasSubstr("holds no points"));
}

TEST(LandmarkReader, NamesTheLineThatIsWrong) {
  EXPECT_THAT(landmarks_refusal("p.csv", "x,y,z\n1,2,3\n4,five,6\n"),
              HasSubstr("line 3 ('4,five,6')"));
  EXPECT_THAT(landmarks_refusal("p.csv", "1,2,3\n4,5\n"), HasSubstr("line 2"));
  EXPECT_THAT(landmarks_refusal("p.csv", "1,2,nan\n"), HasSubstr("line 1"));
  EXPECT_THAT(landmarks_refusal("p.csv", "a,b,c\n1,2,3\n"), HasSubstr("line 1"));
  EXPECT_THAT(landmarks_refusal("p.csv", "# nothing\n"), HasSubstr("no points"));
}

TEST(LandmarkReader, SaysWhenThereIsNoFile) {
  const TemporaryFolder folder;
  const auto found = read_landmarks(folder / "none.csv");
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().kind, ErrorKind::kBadInput);
  write_bytes(folder / "one.csv", "x,y,z\n1,2,3\n");
  ASSERT_TRUE(read_landmarks(folder / "one.csv"));
}

}  // namespace
}  // namespace palpate::files
