palpate_test(quality_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/quality_distances_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/quality_folds_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/quality_inverse_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/quality_match_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/quality_order_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/quality_verdict_test.cpp
  LIBS palpate_quality)
