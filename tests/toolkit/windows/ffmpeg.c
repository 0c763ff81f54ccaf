/* In the place of ffmpeg: writes into the film how many bytes it was sent; one that is called "refused" it refuses. */
#include <fcntl.h>
#include <io.h>
#include <stdio.h>
#include <string.h>

int main(int argc, char** argv) {
  static char block[1 << 16];
  const char* film = argv[argc - 1] + strlen("file:");
  long long bytes = 0;
  size_t n;
  FILE* file;
  if (strstr(film, "refused")) {
    fprintf(stderr, "It knows no such codec\nand says more\n");
    return 1;
  }
  _setmode(0, _O_BINARY);
  while ((n = fread(block, 1, sizeof block, stdin)) > 0) bytes += (long long)n;
  file = fopen(film, "w");
  if (!file) return 2;
  fprintf(file, "%lld", bytes);
  return fclose(file);
}
