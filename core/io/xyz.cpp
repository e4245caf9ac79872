#include <vector>

#include "core/io/mesh_formats.h"
#include "core/io/text_scanner.h"

namespace shaped {

void parseXyz(const std::string& file, std::string_view text, PolygonSoup& soup) {
  TextScanner scanner(file, text);
  std::vector<double> numbers;
  std::size_t columns = 0;
  while (scanner.nextContentLine('#')) {
    numbers.clear();
    for (auto word = scanner.word(); !word.empty(); word = scanner.word())
      numbers.push_back(scanner.numberIn(word, "a coordinate"));
    if (columns == 0) columns = numbers.size();
    if ((columns != 3 && columns != 6) || numbers.size() != columns)
      scanner.fail(std::to_string(numbers.size()) +
                   " numbers stand here; want x y z, or x y z nx ny nz, in every line");
    soup.addVertex(numbers[0], numbers[1], numbers[2]);
    if (columns == 6 && soup.keepsNormals()) soup.addNormal(numbers[3], numbers[4], numbers[5]);
  }
}

}  // namespace shaped
