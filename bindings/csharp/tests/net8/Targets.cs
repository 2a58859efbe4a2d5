using System;
using System.Collections.Generic;
using System.IO;
using System.Linq;
using Microsoft.Build.Evaluation;

/// <summary>
/// Copies what Libsplat.targets adds to a project to where MSBuild copies it. Arguments are the targets of a package,
/// the folder of the program, and properties of the project, "name=value". MSBuild evaluates, its tasks are missing.
/// </summary>
internal static class Targets
{
    private static int Main(string[] arguments)
    {
        var properties = arguments.Skip(2).Select(a => a.Split('=')).ToDictionary(a => a[0], a => a[1]);
        using (var projects = new ProjectCollection(properties))
        {
            ICollection<ProjectItem> items = projects.LoadProject(arguments[0]).GetItems("Content");
            foreach (ProjectItem item in items)
            {
                foreach (string copies in new[] { "CopyToOutputDirectory", "CopyToPublishDirectory" })
                    if (item.GetMetadataValue(copies) != "PreserveNewest")
                        throw new InvalidOperationException(item.EvaluatedInclude + " has no " + copies);
                string to = Path.Combine(arguments[1], item.GetMetadataValue("Link"));
                Directory.CreateDirectory(Path.GetDirectoryName(to) ?? ".");
                File.Copy(item.EvaluatedInclude, to, true);
            }
            Console.WriteLine(items.Count);
        }
        return 0;
    }
}
