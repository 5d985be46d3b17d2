{
  description = "Relight: ray tracing renderer for id Tech 3 engines, and its map tool";

  inputs.nixpkgs.url = "github:NixOS/nixpkgs/nixos-unstable";

  outputs = { self, nixpkgs }:
    let
      systems = [ "x86_64-linux" "aarch64-linux" ];
      workspace = (builtins.fromTOML (builtins.readFile ./Cargo.toml)).workspace.package;
      packages = pkgs: rec {
        # the library (lib/librelight_ffi.so) and the command
        relight = pkgs.rustPlatform.buildRustPackage {
          pname = "relight";
          inherit (workspace) version;
          src = self;
          cargoLock.lockFile = ./Cargo.lock;
          cargoBuildFlags = [ "-p" "ffi" "-p" "cli" ];
          # the tests need a Vulkan device and a game
          doCheck = false;
          # the Vulkan loader is found at run time
          postFixup = ''
            patchelf --add-rpath ${pkgs.vulkan-loader}/lib $out/lib/librelight_ffi.so $out/bin/relight
          '';
          meta = {
            description = "Ray tracing renderer for ioquake3, and its map tool";
            license = with pkgs.lib.licenses; [ mit asl20 ];
            mainProgram = "relight";
            platforms = systems;
          };
        };
        # The engine looks for renderers in the folder of the path by which it is started.
        default = pkgs.runCommand "relight-ioquake3-${workspace.version}" { meta.mainProgram = "ioquake3-relight"; } ''
          mkdir -p $out/bin $out/lib/ioquake3
          ln -s ${pkgs.ioquake3}/share/ioquake3/* $out/lib/ioquake3/
          for name in renderer_vk renderer_vk_${pkgs.stdenv.hostPlatform.parsed.cpu.name}; do
            ln -s ${relight}/lib/librelight_ffi.so $out/lib/ioquake3/$name.so
          done
          engine=$(ls -d $out/lib/ioquake3/ioquake3* | head -n 1)
          printf '#!%s\nexec %s +set cl_renderer vk +set r_rt 1 "$@"\n' ${pkgs.runtimeShell} "$engine" >$out/bin/ioquake3-relight
          chmod +x $out/bin/ioquake3-relight
        '';
      };
    in
    {
      packages = nixpkgs.lib.genAttrs systems (system: packages nixpkgs.legacyPackages.${system});
    };
}
