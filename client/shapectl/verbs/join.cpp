#include <algorithm>
#include <iostream>

#include "client/shapectl/curve_answer.h"
#include "client/shapectl/curve_output.h"
#include "client/shapectl/motion_source.h"
#include "client/shapectl/numbers.h"
#include "client/shapectl/verbs/verbs.h"
#include "core/io/file.h"
#include "shaped/v1/curves.grpc.pb.h"

namespace shaped::shapectl {
namespace {

struct Join {
  std::vector<std::string> clips;
  std::string template_file, out, plot, up;
  std::optional<double> transition, reach;
  double bending = 0;
  FlowFlags flow;

  void declare(Arguments& arguments) {
    arguments.option("--template", template_file, "T.ply", "A mesh of the clips' connectivity");
    arguments.option("-o,--out", out, "OUT.npy", "The joined motion");
    arguments.required();
    arguments.option("--transition", transition, "N", "Frames between clips that do not meet (to keep the speed)");
    arguments.option("--up", up, "AXIS", "x, y or z: clips turn about it alone and keep their height (any motion)");
    arguments.option("--reach", reach, "N", "Frames of each clip next to a seam that may change (20)");
    flow.declare(arguments, "50");
    arguments.option("--bending", bending, "ETA", "Bending weight [m^2] (2.5e-5 times the squared diameter)");
    arguments.option("--plot", plot, "P.svg", "Draw how sharp the motion's corner is at each frame, before and after");
    arguments.positionals("CLIP", clips, 2, "Motions: n x V x 3 .npy, metres, or datasets on the daemon");
  }

  ExitCode run(const Session& session) const {
    v1::JoinRequest request = requestFor();
    const MotionSource motions(session, clips, template_file);
    for (const auto& name : motions.names()) request.add_datasets(name);
    client::Call call(session.callOptions());
    const auto stub = v1::Curves::NewStub(session.channel());
    const auto stream = stub->Join(call.context(), request);
    const auto summary = receiveCurve(*stream, out);
    if (!plot.empty()) writeFile(plot, gradientPlot(summary.smooth(), "seams"));
    print(summary, session);
    return exitCodeOf(summary.smooth().report());
  }

 private:
  v1::JoinRequest requestFor() const {
    v1::JoinRequest request;
    if (transition) request.set_transition_frames(wholeOf("--transition", *transition));
    if (reach) request.set_reach(wholeOf("--reach", *reach));
    if (!up.empty() && up != "x" && up != "y" && up != "z")
      throw InvalidInput("--up", "is \"" + up + "\", want x, y or z");
    if (!up.empty())
      for (const char axis : {'x', 'y', 'z'}) request.add_up(axis == up[0] ? 1 : 0);
    flow.fill(*request.mutable_flow());
    request.set_bending(bending);
    return request;
  }

  void print(const v1::JoinSummary& summary, const Session& session) const {
    nlohmann::json more;
    auto& seams = more["seams"] = nlohmann::json::array();
    const auto& smooth = summary.smooth();
    for (const auto& seam : summary.seams()) {
      double before = 0, after = 0;
      for (auto i = seam.before(); i <= seam.after(); ++i) {
        before = std::max(before, smooth.gradient_before(static_cast<int>(i)));
        after = std::max(after, smooth.gradient_after(static_cast<int>(i)));
      }
      seams.push_back({{"last_frame", seam.before()},
                       {"first_frame", seam.after()},
                       {"gradient_before", before},
                       {"gradient_after", after}});
    }
    printSmoothing(smooth, more, out, session);
    if (session.json) return;
    for (const auto& seam : seams)
      std::cout << "  seam at frames " << seam["last_frame"] << " to " << seam["first_frame"] << ": corner "
                << seam["gradient_before"] << " -> " << seam["gradient_after"] << " m\n";
  }
};

}  // namespace

Verb joinVerb() { return makeVerb<Join>("join", "Put motions one after the other and round the corners between them"); }

}  // namespace shaped::shapectl
