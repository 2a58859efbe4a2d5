using System;
using System.Collections.Generic;
using Splat.Interop;

namespace Splat
{
    /// <summary>Configurations of networks and trainings.</summary>
    public static unsafe class Config
    {
        /// <summary>JSON array of all keys: type, range, default, meaning.</summary>
        public static string KeysJson() => Text.Get(Native.splat_config_keys);

        /// <summary>JSON array of the configurations of published models: name, about.</summary>
        public static string PresetsJson() => Text.Get(Native.splat_config_presets);

        /// <summary>The text of one of them, YAML, for Merge.</summary>
        public static string Preset(string name)
        {
            using (var arena = new Arena())
            {
                byte* text = arena.Text(name, nameof(name));
                return Text.Get((buffer, capacity, needed) => Native.splat_config_preset(
                    text, buffer, capacity, needed));
            }
        }

        /// <summary>
        /// A configuration with every value, as JSON, from the text of a YAML or JSON file (null:
        /// the defaults) and changes "key=value", such as "opt.base_lr=1e-4".
        /// </summary>
        public static string Merge(string text, params string[] values)
        {
            using (var arena = new Arena())
            {
                byte* from = arena.Optional(text, nameof(text));
                byte** changes = arena.Texts(Check.NotNull(values, nameof(values)), nameof(values));
                return Text.Get((buffer, capacity, needed) => Native.splat_config_merge(
                    from, changes, (UIntPtr)values.Length, buffer, capacity, needed));
            }
        }

        /// <summary>JSON: what a training of that configuration would leave out.</summary>
        public static string CheckJson(string text, params string[] values)
        {
            using (var arena = new Arena())
            {
                byte* from = arena.Optional(text, nameof(text));
                byte** changes = arena.Texts(Check.NotNull(values, nameof(values)), nameof(values));
                return Text.Get((buffer, capacity, needed) => Native.splat_config_check(
                    from, changes, (UIntPtr)values.Length, buffer, capacity, needed));
            }
        }
    }
}
