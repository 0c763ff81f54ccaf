#pragma once

namespace palpate::app {

/// What this process needs of its system before anything else. The words of the command line are
/// UTF-8 from here on, names with * or ? are replaced by those of the files there (on Windows,
/// whose shells do not do this), and what is printed is shown as UTF-8. On Linux a file that
/// reached its size limit and a closed pipe become write errors: they must not kill a program that
/// may be applying a force.
void prepare_process(int& argc, char**& argv);

/// Gives a variable of the environment a value unless it has one. Before any thread starts.
void set_if_missing(const char* name, const char* value);

}  // namespace palpate::app
