#include "tests/lab/report/page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/lab/tests/report/xml_check.h"

namespace palpate::report {
namespace {

using testing::HasSubstr;
using testing::Not;

Table small_table() {
  return {"Errors & times",
          "Of \"one\" run.",
          {{"method", "method"}, {"error_mm", "error, mm"}},
          {{words("a, \"b\""), number(0.12345, 2)}, {words("<c>"), nothing()}}};
}

Page small_page() {
  Page page;
  page.title = "Speed & accuracy";
  page.lead = "First <paragraph>.\n\nSecond.";
  page.conditions = {{"Device", "a & b"}};
  Section section{"motion", "Motion", "Take <fast>.", {}};
  section.parts.push_back(
      Figure{"A figure", "<svg xmlns=\"http://www.w3.org/2000/svg\"/>", "Words.", small_table()});
  section.parts.push_back(TablePart{small_table(), true});
  section.parts.push_back(Note{"ITK is not here.", true});
  page.sections = {section, {"feel", "Feel", "", {}}};
  return page;
}

TEST(ReportPage, IsWellFormedWhateverTheTextsHold) {
  EXPECT_EQ(test::xml_trouble(html(small_page())), "");
  Page odd;
  odd.title = "]]> <!-- \x01 \" ' &amp;";
  odd.sections = {{"a", "</section>", "&", {Note{"<p>", false}}}};
  EXPECT_EQ(test::xml_trouble(html(odd)), "");
}

TEST(ReportPage, NeedsNothingFromOutside) {
  const std::string page = html(small_page());
  EXPECT_THAT(page, Not(HasSubstr("<script")));
  EXPECT_THAT(page, Not(HasSubstr("src=")));
  EXPECT_THAT(page, Not(HasSubstr("href=\"http")));
}

TEST(ReportPage, SaysTheAnswerBeforeTheFigure) {
  const std::string page = html(small_page());
  const size_t answer = page.find("Take &lt;fast&gt;."), figure = page.find("<figure>");
  ASSERT_NE(answer, std::string::npos);
  ASSERT_NE(figure, std::string::npos);
  EXPECT_LT(answer, figure);
  EXPECT_THAT(page, HasSubstr("<p>First &lt;paragraph&gt;.</p>\n<p>Second.</p>"));
  EXPECT_THAT(page, HasSubstr("<p class=\"grave\">ITK is not here.</p>"));
}

TEST(ReportPage, CarriesTheNumbersAsCsv) {
  EXPECT_EQ(flat_csv(small_table()), "method,error_mm\n\"a, \"\"b\"\"\",0.12345\n<c>,\n");
  // The same text in base64, as computed by another program.
  EXPECT_THAT(html(small_page()),
              HasSubstr("download=\"errors-times.csv\" href=\"data:text/csv;charset=utf-8;base64,"
                        "bWV0aG9kLGVycm9yX21tCiJhLCAiImIiIiIsMC4xMjM0NQo8Yz4sCg==\""));
}

TEST(FileStem, HasNothingThatAFileSystemMinds) {
  EXPECT_EQ(file_stem("Error / time (s)"), "error-time-s");
  EXPECT_EQ(file_stem("..."), "table");
}

}  // namespace
}  // namespace palpate::report
